"""A hash of what a result depends on, by which what is kept of it is known to be still valid."""

from __future__ import annotations

import hashlib
from pathlib import Path

SOURCES = ".py", ".h", ".cpp"


def fingerprint(*parts: str | Path) -> str:
    """Hash of texts and of files' contents; a folder counts with all sources below it."""
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, str):
            digest.update(b"text" + part.encode())
            continue
        inside = (file for file in part.rglob("*") if file.suffix in SOURCES)
        for file in [part] if part.is_file() else sorted(inside):
            name = str(file.relative_to(part)) if part.is_dir() else file.name
            digest.update(name.encode() + hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()
