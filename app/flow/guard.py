"""Runs a command whose processes all end with us, even where we are killed.

    python guard.py COMMAND...

Whoever starts it holds the other end of its stdin: once that is closed, on purpose or because its
holder died, the command's process group is interrupted as by Ctrl-C and, after a grace, killed. So
too with what the command leaves behind when it ends. The first line on stdout is the group's
number; the rest is the command's. It imports the standard library alone, to start in no time.
Orphans of the command become its own (on Linux), for not every process 1 looks at its dead.
"""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress

GRACE = 8.0  # s from the interrupt to the kill
PR_SET_PDEATHSIG, PR_SET_CHILD_SUBREAPER = 1, 36


def end_group(
    group: int, grace: float = GRACE, first: int = signal.SIGINT, reap: bool = False
) -> None:
    """Interrupt the process group, wait until it is empty, and kill what is left after `grace`.

    Args:
        group: Its number.
        grace: In seconds.
        first: The signal that interrupts.
        reap: Whether its dead are ours, and nobody else waits for them: they count as members.
    """
    deadline = time.monotonic() + grace
    with suppress(ProcessLookupError, PermissionError):  # nobody, or nobody of ours
        os.killpg(group, first)  # DVC gives its locks back, a stage its temporary files
        while time.monotonic() < deadline:
            with suppress(ChildProcessError):
                while reap and os.waitpid(-group, os.WNOHANG)[0]:
                    pass
            os.killpg(group, 0)  # asks only
            time.sleep(0.02)
        os.killpg(group, signal.SIGKILL)


def start(command: list[str], **options) -> subprocess.Popen:
    """Start a command behind a guard; `options` are of subprocess.Popen. `end` is to follow."""
    return subprocess.Popen(
        # A bare interpreter: it starts in a hundredth of a second.
        [sys.executable, "-I", "-S", __file__, *command],
        stdin=subprocess.PIPE,  # its end is ours: who is killed leaves no command
        start_new_session=True,  # a terminal's Ctrl-C is for us alone
        **options,
    )


def end(guard: subprocess.Popen, group: Callable[[], int]) -> None:
    """End what `start` started; nothing of the command is left then.

    Args:
        group: The number that the guard said, 0 if none; asked where the guard was killed.
    """
    with suppress(OSError):
        if guard.stdin:
            guard.stdin.close()
    try:
        guard.wait(GRACE + 5)
    except subprocess.TimeoutExpired:
        guard.kill()
    if guard.wait() < 0 and (number := group()):
        end_group(number, GRACE)
    if guard.stdout:
        guard.stdout.close()


def main(command: list[str]) -> int:
    """Run `command`; returns its exit status, as a shell has it."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda *_: None)  # ours ends by stdin; the command gets the default
    _control(PR_SET_CHILD_SUBREAPER, 1)
    child = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        process_group=0,
        preexec_fn=lambda: _control(
            PR_SET_PDEATHSIG, signal.SIGINT
        ),  # where we ourselves are killed
    )
    print(child.pid, flush=True)

    def ended_from_above() -> None:
        while os.read(0, 1):  # not sys.stdin, whose lock a daemon thread would take to its grave
            pass
        end_group(child.pid)

    threading.Thread(target=ended_from_above, daemon=True).start()
    status = child.wait()
    end_group(child.pid, first=signal.SIGTERM, reap=True)  # without the words of an interrupt
    return status if status >= 0 else 128 - status


def _control(option: int, value: int) -> None:
    """Linux's prctl; elsewhere nothing."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(option, value, 0, 0, 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
