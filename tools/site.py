"""Build the pages as a site: `make docs`. Links and anchors are checked; a broken one fails.

    python tools/site.py    # build/site/index.html; needs the extra `docs`

Pages link to files all over the project, so the source of the site is a copy of it. The reference
is made: functions of their docstrings, commands of their help, settings of params.yaml.
"""

from __future__ import annotations

import base64
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

import sling2sim2real  # noqa: E402
from sling2sim2real.base import errors  # noqa: E402
from sling2sim2real.base.errors import UserError  # noqa: E402
from sling2sim2real.cli.cli import parser  # noqa: E402

SOURCE = ROOT / "build" / "site-source"
LEFT_OUT = "tests/", ".dvc/", "dvc.lock"
# In a docstring, up to an empty line or the end.
EXAMPLE = re.compile(r'^( +)>>> .*\n(?:\1(?!""").*\n)*', re.MULTILINE)


def lay_out(folder: Path) -> None:
    """Copy what Git has into `folder`, and write the page of the reference."""
    shutil.rmtree(folder, ignore_errors=True)
    listed = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    for name in listed.stdout.splitlines():
        if not name.startswith(LEFT_OUT) and (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, folder / name)
    for file in (folder / "sling2sim2real").rglob("*.py"):
        file.write_text(EXAMPLE.sub(_headed, file.read_text("utf-8")), encoding="utf-8")
    for file in (folder / "docs" / "notebooks").glob("*.ipynb"):
        file.with_suffix(".md").write_text(notebook(file), encoding="utf-8")
    names = "\n\n".join(f"::: sling2sim2real.{name}" for name in sling2sim2real.__all__)
    written = {
        "functions": f"# Python functions\n\n{names}\n",
        "commands": f"# Commands\n{commands()}",
        "settings": f"# Settings\n\n```yaml\n{(ROOT / 'params.yaml').read_text('utf-8')}```\n",
    }
    for name, text in written.items():
        (folder / "docs" / "reference" / f"{name}.md").write_text(text, encoding="utf-8")


def notebook(path: Path) -> str:
    """A notebook as a page; its pictures lie beside it."""
    url = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["urls"][
        "Repository"
    ]
    place = f"{url.removeprefix('https://github.com/')}/blob/main/docs/notebooks/{path.name}"
    parts = []
    for number, cell in enumerate(json.loads(path.read_text("utf-8"))["cells"]):
        source = "".join(cell["source"])
        parts.append(source if cell["cell_type"] == "markdown" else f"```python\n{source}\n```")
        for output in cell.get("outputs", []):
            data = output.get("data", {})
            if "image/png" in data:
                picture = path.with_name(f"{path.stem}-{number}.png")
                picture.write_bytes(base64.b64decode(data["image/png"]))
                parts.append(f"![output of the cell above]({picture.name})")
            else:
                text = "".join(output.get("text", data.get("text/plain", "")))
                parts.append(f"```\n{text.rstrip()}\n```")
    parts.insert(1, f"[Open in Colab](https://colab.research.google.com/github/{place})")
    return "\n\n".join(parts) + "\n"


def commands() -> str:
    """The help of each command of `sling`."""
    subs = next(vars(action)["choices"] for action in parser()._actions if action.choices)
    return "".join(
        f"\n## sling {name}\n\n```\n{command.format_help()}```\n" for name, command in subs.items()
    )


def _headed(example: re.Match) -> str:
    """An example under the heading by which the reference knows one."""
    lines = "".join(f"    {line}\n" for line in example[0].splitlines())
    return f"{example[1]}Examples:\n{lines}"


def main() -> int:
    try:
        import mkdocs  # noqa: F401
    except ModuleNotFoundError as error:
        raise UserError("mkdocs is not installed: make docs installs it") from error
    lay_out(SOURCE)
    build = [sys.executable, "-m", "mkdocs", "build", "--clean", "--quiet"]
    quiet = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    status = subprocess.run(build, cwd=ROOT, env=quiet).returncode
    if not status:
        print(f"{(ROOT / 'build/site/index.html').resolve().as_uri()}")
    return status


if __name__ == "__main__":
    errors.run(main)
