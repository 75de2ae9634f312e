"""A hash of what a result depends on, by which what is kept of it is known to be still valid."""

from __future__ import annotations

import hashlib
from pathlib import Path


def fingerprint(*parts: str | Path) -> str:
    """Hash of texts and of files' contents; a folder counts with its sources."""
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, str):
            digest.update(b"text" + part.encode())
            continue
        files = [part] if part.is_file() else sorted([*part.glob("*.py"), *part.glob("*.h")])
        for file in files:
            digest.update(file.name.encode() + hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()
