"""Committed files of campaigns, which are no part of a run."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from pipeline.base.errors import UserError

FOLDER = Path("reports", "validation")
Content = TypeVar("Content")


def committed(path: Path, writer: str, read: Callable[[Any], Content]) -> Content | None:
    """What `read` makes of a JSON file; None where there is none.

    Raises UserError where it is not what the module `writer` writes.
    """
    if not path.exists():
        return None
    try:
        return read(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise UserError(
            f"{path}: is not what {writer} writes ({error!r}); `git checkout` it"
        ) from error
