"""The decorator that compiles the rig's inner functions with Numba, once for all processes.

What is compiled is kept in the first folder of these that can be written: NUMBA_CACHE_DIR, beside
the code, the user's cache, one for temporary files. There it lies by a digest of the whole package:
Numba alone would miss a change in a function that another file calls.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core import config

HERE = Path(__file__).parent


def _folders() -> list[Path]:
    """Where compiled code may lie, best first."""
    requested = os.environ.get("NUMBA_CACHE_DIR")
    cache = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    shared = Path(tempfile.gettempdir()) / f"sling2sim2real-{os.getuid()}"
    folders = [HERE / "__pycache__", Path(cache) / "sling2sim2real", shared]
    return [Path(requested), *folders] if requested else folders


def _is_ours(folder: Path) -> bool:
    """Whether it can be written, and by nobody else: what lies there is run."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
        return folder.stat().st_uid == os.getuid()
    except OSError:
        return False


def _folder() -> str:
    sources = sorted(HERE.glob("*.py"))
    digest = hashlib.sha256(b"".join(file.read_bytes() for file in sources)).hexdigest()[:12]
    for folder in _folders():
        if _is_ours(folder / f"numba-{digest}"):
            return str(folder / f"numba-{digest}")
    return tempfile.mkdtemp()


FOLDER = _folder()


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """`function` as machine code, for each kind of arguments at the first call with them."""
    before = getattr(config, "CACHE_DIR")  # noqa: B009, a checker does not see it
    setattr(config, "CACHE_DIR", FOLDER)  # noqa: B010
    try:
        return numba.njit(cache=True, error_model="numpy", forceinline=True)(function)
    finally:
        setattr(config, "CACHE_DIR", before)  # noqa: B010
