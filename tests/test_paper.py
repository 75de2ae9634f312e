"""How long the run with the paper's budget took, though it was killed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from tests.project import ROOT
from tools.paper import KEPT, timed

RUN = ["sh", "-c", "test -e finish || exec sleep 60"]
TOLD = "import sys; from pathlib import Path; from tools.paper import timed;"


def test_stretches_add_up_over_a_kill_until_a_run_succeeds(tmp_path: Path) -> None:
    code = f"{TOLD} timed({RUN}, Path({str(tmp_path)!r}), tick=0.05)"
    first = subprocess.Popen([sys.executable, "-c", code], cwd=ROOT, start_new_session=True)
    try:
        seconds, latest = 0.0, time.monotonic() + 60
        while seconds < 0.3:
            assert time.monotonic() < latest and first.poll() is None
            time.sleep(0.02)
            if (tmp_path / KEPT).is_file():
                seconds = json.loads((tmp_path / KEPT).read_text())["stretches"][0]
    finally:
        os.killpg(first.pid, signal.SIGKILL)
        first.wait(10)
    (tmp_path / "finish").touch()
    status, (before, last) = timed(RUN, tmp_path)
    assert status == 0 and 0.3 <= before < 60 and last < 0.3
    assert not (tmp_path / KEPT).exists()
    assert len(timed(RUN, tmp_path)[1]) == 1


def test_a_run_that_fails_keeps_its_time_and_another_command_begins_anew(tmp_path: Path) -> None:
    fails = ["sh", "-c", "exit 3"]
    assert [timed(fails, tmp_path) for _ in range(2)][1] == (3, [0.0, 0.0])
    assert len(timed(["true"], tmp_path)[1]) == 1
