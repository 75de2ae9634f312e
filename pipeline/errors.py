"""The one exception for a user's mistake: commands and stages print it as one line and exit 1."""

from __future__ import annotations

import sys
from collections.abc import Callable


class UserError(Exception):
    """Bad input. The message says what is wrong, where, and how to mend it, in one line."""


def run(main: Callable[[], int | None]) -> None:
    """Run a command: a UserError becomes one line on stderr and exit status 1."""
    try:
        status = main()
    except UserError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(130)
    sys.exit(status or 0)
