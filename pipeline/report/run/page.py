"""reports/index.html and appendix.html: a page each as one file that needs no network.

Only run.js lies beside them, which says where and when they were written and may be missing.
"""

from __future__ import annotations

import re
from pathlib import Path

from pipeline.base.files import write_text
from pipeline.report.drawing.page import page

HTML = {"README": "index", "appendix": "appendix"}  # names of pages
LINK = re.compile(rf"\]\(((?:bands/[^)/]+/)?)({'|'.join(HTML)})\.md\)")
RUN = """\
<p id="run"></p>
<script src="run.js"></script>
<script>
if (window.run) {
  const about = Object.entries(run).map(([name, value]) => `${name}: ${value}`);
  document.getElementById("run").textContent = "This run. " + about.join(" · ");
}
</script>"""


def write_page(folder: Path, name: str, markdown: str) -> None:
    """Write <name>.md as HTML into `folder`, where the text's pictures lie. Raises UserError.

    Links to texts become links to their pages.
    """
    text = LINK.sub(lambda link: f"]({link[1]}{HTML[link[2]]}.html)", markdown)
    title = "Sling2Sim2Real: " + ("report" if name == "README" else name)
    write_text(folder / f"{HTML[name]}.html", page(text, folder, title, foot=RUN))
