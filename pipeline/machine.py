"""Where simulations run: said by the environment, because results depend on it by rounding alone.

SLING_DEVICE (cpu or cuda:0; default cpu) and SLING_WORKERS (threads on the CPU; default all cores).
"""

from __future__ import annotations

import os

from pipeline.errors import UserError


def device() -> str:
    """SLING_DEVICE. Raises UserError."""
    name = os.environ.get("SLING_DEVICE") or "cpu"
    if name != "cpu" and not name.startswith("cuda"):
        raise UserError(f"SLING_DEVICE must be cpu or cuda:0 and the like, got {name!r}")
    return name


def workers() -> int | None:
    """SLING_WORKERS; None is all cores. Raises UserError."""
    text = os.environ.get("SLING_WORKERS")
    if not text:
        return None
    if not (text.isascii() and text.isdigit() and int(text) > 0):
        raise UserError(f"SLING_WORKERS must be a whole number above 0, got {text!r}")
    return int(text)
