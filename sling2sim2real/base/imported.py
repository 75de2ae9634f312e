"""Code of a user's that params.yaml names as `package.module:name`."""

from __future__ import annotations

import importlib
import re
import sys
from pathlib import Path
from typing import Any


def is_import(text: str) -> bool:
    """Whether a text reads as `package.module:name`."""
    return text.count(":") == 1 and all(part.isidentifier() for part in re.split("[.:]", text))


def imported(text: str) -> Any:
    """What `package.module:name` names, seen from the working directory; raises what it raises."""
    if str(Path.cwd()) not in sys.path:  # a command's is where it is installed
        sys.path.append(str(Path.cwd()))
    module, _, attribute = text.partition(":")
    return getattr(importlib.import_module(module), attribute)
