"""The one exception for a user's mistake: commands and stages print it as one line and exit 1."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)  # a disk that takes no more


class UserError(Exception):
    """Bad input. The message says what is wrong, where, and how to mend it, in one line."""


def one_line(said: object) -> str:
    """What somebody else said, such as a library's error, as one line."""
    return printable(" ".join(str(said).split()))


def printable(text: str) -> str:
    """What a file calls itself or holds, on one line, with nothing that a terminal obeys."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def run(main: Callable[[], int | None]) -> None:
    """Run a command: a UserError, or a full disk, becomes one line on stderr and exit status 1."""
    try:
        status = main()
        sys.stdout.flush()
    except UserError as error:
        print(f"error: {printable(str(error))}", file=sys.stderr)
        sys.exit(1)
    except BrokenPipeError:  # the reader, such as head, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except OSError as error:
        if error.errno not in FULL:
            raise
        what = f"{error.filename}:" if error.filename else "a file"
        print(f"error: {what} cannot be written ({os.strerror(error.errno)})", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(130)
    sys.exit(status or 0)
