"""Texts that are compared with committed files: a reader sees what a change does to them."""

import os
from difflib import unified_diff
from pathlib import Path


def expect_golden(text: str, file: Path) -> None:
    """The text is the file's. After a wanted change: `WRITE_GOLDEN=1 pytest ...`, read the diff."""
    if "WRITE_GOLDEN" in os.environ:
        file.parent.mkdir(exist_ok=True)
        file.write_text(text, encoding="utf-8")
    lines = file.read_text(encoding="utf-8").splitlines(), text.splitlines()
    changed = "\n".join(unified_diff(*lines, "committed", "now", n=0, lineterm=""))
    assert not changed, f"{file}:\n{changed}"
