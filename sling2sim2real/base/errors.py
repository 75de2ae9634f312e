"""The one exception for a user's mistake: commands and stages print it as one line and exit 1."""

from __future__ import annotations

import errno
import io
import os
import signal
import sys
from collections.abc import Callable

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)  # a disk that takes no more
REFUSED = 3  # exit status
DENIED = (errno.EACCES, errno.EPERM, errno.EROFS)  # a file that is another user's, a fixed disk


class UserError(Exception):
    """Bad input. The message says what is wrong, where, and how to mend it, in one line."""


class Refused(UserError):
    """There is an answer, but nobody should act on it: a robot may listen. Exit status REFUSED."""


def one_line(message: object) -> str:
    """What somebody else said, such as a library's error, as one line."""
    return printable(" ".join(str(message).split()))


def printable(text: str) -> str:
    """What a file calls itself or holds, on one line, with nothing that a terminal obeys."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def refused(error: OSError) -> str | None:
    """What a file system does not let us do, and how to mend it; None for any other error."""
    if error.errno not in (*FULL, *DENIED):
        return None
    why, path = os.strerror(error.errno), error.filename
    if path is None:  # pyarrow has it in its words
        return f"a file cannot be written ({one_line(error.strerror or error)})"
    path = os.fsdecode(path) if isinstance(path, str | bytes) else str(path)
    if error.errno in FULL:
        return f"{path}: cannot be written ({why})"
    if error.errno == errno.EROFS:
        return f"{path}: cannot be written ({why}): copy the project to a disk that can be written"
    return f"{path}: may not be read or written here ({why}){_whose(path)}"


def _whose(path: str) -> str:
    """Name the owner of the file, or of the folder to hold it, where that is another user."""
    there = os.path.abspath(path)
    while not os.path.lexists(there):
        there = os.path.dirname(there)
    owner, us = os.lstat(there).st_uid, os.geteuid()
    if owner == us:
        return ""
    what = "it" if there == os.path.abspath(path) else there
    return f": {what} is user {owner}'s, you are {us}; have it yours (chown), or copy the project"


# What extras of pyproject.toml bring, as it is imported.
EXTRAS = {
    "run": "botorch dvc fastapi gpytorch gymnasium networkx numba onnx onnxscript prefect psutil"
    " rsl_rl sksundae tensordict torch",
    "cluster": "dask dask_jobqueue distributed",
    "view": "rerun",
}


def absent(error: ModuleNotFoundError) -> str | None:
    """How to get a package that a light install lacks; None for any other."""
    name = str(error.name).partition(".")[0]
    for extra, names in EXTRAS.items():
        if name in names.split():
            how = f"pip install '.[{extra}]' -c constraints.txt in the project's folder"
            setup = "" if extra == "view" else "make setup, or "
            return f"{name} is not installed: {setup}{how}"
    return None


def run(main: Callable[[], int | None]) -> None:
    """Run a command: a UserError, or what a disk refuses, is one line on stderr, exit status 1.

    What a terminal's encoding has not is written as Python writes it, by an escape. SIGTERM
    interrupts as Ctrl-C does.
    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        status = main()
        sys.stdout.flush()
    except UserError as error:
        print(f"error: {printable(str(error))}", file=sys.stderr)
        sys.exit(REFUSED if isinstance(error, Refused) else 1)
    except ModuleNotFoundError as error:
        if not (line := absent(error)):
            raise
        print(f"error: {line}", file=sys.stderr)
        sys.exit(1)
    except BrokenPipeError:  # the reader, such as head, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except OSError as error:
        if not (line := refused(error)):
            raise
        print(f"error: {printable(line)}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(130)
    sys.exit(status or 0)
