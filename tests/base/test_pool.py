"""Processes of a pool end with the one that started them, and leave Ctrl-C to it."""

import os
import signal
import sys
from pathlib import Path

import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.pool import Pool
from tests.project import python
from validation.projects import MarkedRun, wait

CODE = """\
import os, sys, time
from pathlib import Path
from sling2sim2real.base import errors
from sling2sim2real.base.pool import Pool

def busy(number):
    Path(f"worker-{number}").touch()
    time.sleep(2)

def main():
    with Pool(workers=2) as pool:
        list(pool.map(busy, range(6)))

if __name__ == "__main__":
    errors.run(main)
"""


@pytest.mark.parametrize(
    ("number", "status"), [(signal.SIGINT, 130), (signal.SIGKILL, -signal.SIGKILL)]
)
def test_workers_end_with_their_pool(tmp_path: Path, number: int, status: int) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "busy.py").write_text(CODE)
    run = MarkedRun(folder)
    process = run.start(sys.executable, "busy.py")
    assert wait(lambda: len(list(folder.glob("worker-*"))) >= 2, 30), run.message
    if number == signal.SIGINT:
        os.killpg(process.pid, number)  # as a terminal does
    else:
        process.kill()
    assert process.wait(20) == status
    assert run.left() == []
    if number == signal.SIGINT:
        assert run.message == "interrupted\n"
    assert len(list(folder.glob("worker-*"))) < 6


def test_a_killed_worker_is_one_line() -> None:
    with Pool(workers=1) as pool, pytest.raises(UserError, match="was killed, perhaps for want of"):
        list(pool.map(signal.raise_signal, [signal.SIGKILL]))


def test_a_pool_is_as_wide_as_the_environment_says() -> None:
    summary = "from sling2sim2real.base.pool import Pool; print(Pool()._max_workers)"
    assert python("-c", summary, SLING_WORKERS="3").stdout == "3\n"
