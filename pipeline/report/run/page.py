"""reports/index.html: the report as one file that needs no network.

Only run.js lies beside it, which says where and when it was written and may be missing.
"""

from __future__ import annotations

import re
from pathlib import Path

from pipeline.base.files import write_text
from pipeline.report.drawing.page import page

CARD = re.compile(r"\]\((bands/[^)/]+)/README\.md\)")
RUN = """\
<p id="run"></p>
<script src="run.js"></script>
<script>
if (window.run) {
  const about = Object.entries(run).map(([name, value]) => `${name}: ${value}`);
  document.getElementById("run").textContent = "This run. " + about.join(" · ");
}
</script>"""


def write_page(folder: Path, markdown: str) -> None:
    """Write index.html into `folder`, where the text's pictures lie. Raises UserError.

    Bands link to the pages of their cards.
    """
    pages = CARD.sub(r"](\1/index.html)", markdown)
    write_text(folder / "index.html", page(pages, folder, "Sling2Sim2Real: report", foot=RUN))
