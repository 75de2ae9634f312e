"""`sling flow` and `sling ui`, as processes in a small project."""

import json
import signal
import socket
import urllib.request
from pathlib import Path

import pytest

from tests.flow.toy import MEET, Toy, stage
from tests.project import until

pytestmark = pytest.mark.slow


def test_a_flow_does_what_dvc_repro_does_side_by_side(tmp_path: Path) -> None:
    """Two stages that wait for each other, one after them, and one of another chain."""
    progress = "echo 'l 1/2 rollouts'; echo 'l 2/2 rollouts'"
    stages = {
        "left": stage(f"{MEET.format('l', 'r')}; {progress}; echo 1 > l.txt", "l.txt"),
        "right": stage(f"{MEET.format('r', 'l')}; echo 2 > r.txt", "r.txt"),
        "sum": stage("cat l.txt r.txt > sum.txt", "sum.txt", "l.txt", "r.txt"),
        "other": stage("echo $OMP_NUM_THREADS > other.txt", "other.txt"),
    }
    toy = Toy(tmp_path, stages)
    status, lines = toy.flow(all_proxy="socks5://127.0.0.1:1", PREFECT_API_URL="http://nowhere")
    assert status == 0 and lines[-1].startswith("stages: 4 Completed ("), lines
    assert "left | l 2/2 rollouts" in lines
    assert toy.read("sum.txt") == "1\n2" and toy.read("other.txt") == "1"  # of two cores
    assert toy.states() == dict.fromkeys(stages, "Completed")
    bars = toy.rows("select key, data from artifact where type = 'progress'")
    assert bars == [("left", 100)]
    assert toy.run("dvc", "status")[1] == ["Data and pipelines are up to date."]
    before = (tmp_path / ".prefect" / "prefect.db").stat().st_mtime_ns
    assert toy.flow() == (0, ["nothing is stale"])
    assert (tmp_path / ".prefect" / "prefect.db").stat().st_mtime_ns == before
    assert not toy.processes()


def test_what_follows_from_a_failure_does_not_run_and_the_rest_does(tmp_path: Path) -> None:
    stages = {
        "first": stage("date +%N > first.txt; echo 1 > out.txt", "out.txt"),
        "says": stage("echo 'error: it is so' >&2; exit 1", "says.txt", "out.txt"),
        "silent": stage("exit 3", "silent.txt"),
        "follows": stage("cp says.txt follows.txt", "follows.txt", "says.txt"),
        "fine": stage("cp out.txt fine.txt", "fine.txt", "out.txt"),
    }
    toy = Toy(tmp_path, stages)
    status, lines = toy.flow()
    assert status == 1
    assert lines[-1].startswith("error: stages: ")
    for words in ("2 Completed", "2 Failed", "1 NotReady", "; says: it is so"):
        assert words in lines[-1]
    assert "silent: said nothing (exit status 3)" in lines[-1]
    failed = dict.fromkeys(("says", "silent"), "Failed")
    ran = dict.fromkeys(("first", "fine"), "Completed")
    assert toy.states() == {**failed, **ran, "follows": "NotReady"}
    stages["says"]["cmd"] = "cp out.txt says.txt"
    stages["first"]["cmd"] += "; true"  # another command that writes the same bytes
    toy.write(stages)
    status, lines = toy.flow("follows", "fine")
    assert status == 0 and lines[-1].startswith("stages: "), lines


def test_stages_that_compute_on_a_gpu_take_turns(tmp_path: Path) -> None:
    command = "[ ! -e busy ] && touch busy && sleep 1 && rm busy && touch {0}"
    stages = {name: stage(command.format(name), name) for name in ("history", "search")}
    toy = Toy(tmp_path, stages)
    status, lines = toy.flow(SLING_DEVICE="cuda:0")
    assert status == 0, lines


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_ends_all_processes(tmp_path: Path, number: int) -> None:
    stages = {
        "left": stage("echo begun > l.txt; sleep 300", "l.txt"),
        "right": stage("echo begun > r.txt; sleep 300 & wait", "r.txt"),
    }
    toy = Toy(tmp_path, stages)
    flow = toy.start("sling", "flow")
    until(lambda: (tmp_path / "l.txt").exists() and (tmp_path / "r.txt").exists())
    assert toy.end(flow, number) == 130
    assert not toy.processes()
    assert toy.run("dvc", "status")[0] == 0


def test_after_a_kill_the_next_flow_does_what_is_stale_and_no_more(tmp_path: Path) -> None:
    """What it has left behind ends by itself; its outputs may be in DVC's cache of runs."""
    stages = {
        "done": stage("echo 1 >> runs; echo 1 > done.txt", "done.txt"),
        "long": stage(
            "touch begun; while [ -e pause ]; do sleep 0.1; done; echo 1 >> runs;"
            " cp done.txt long.txt",
            "long.txt",
            "done.txt",
        ),
    }
    toy = Toy(tmp_path, stages)
    (tmp_path / "pause").touch()
    flow = toy.start("sling", "flow")
    until((tmp_path / "begun").exists)
    toy.end(flow, signal.SIGKILL)
    assert "is busy" in toy.flow()[1][-1]
    (tmp_path / "pause").unlink()
    until(lambda: not any("dvc.cli" in " ".join(process.cmdline()) for process in toy.processes()))
    status, lines = toy.flow()
    assert status == 0 and lines[-1].startswith("stages: 1 Completed ("), lines
    assert toy.read("runs") == "1\n1" and toy.read("long.txt") == "1"
    assert toy.run("dvc", "status")[1] == ["Data and pipelines are up to date."]
    for process in toy.processes():  # Prefect's own server outlives a flow that is killed
        assert "uvicorn" in process.cmdline()
        process.kill()


def test_the_server_of_sling_ui_has_the_runs(tmp_path: Path) -> None:
    toy = Toy(tmp_path, {"one": stage("echo 1 > one.txt", "one.txt")})
    port = free_port()
    ui = toy.start("sling", "ui", "--port", str(port))
    address = f"http://127.0.0.1:{port}"
    try:
        until(lambda: answer(f"{address}/api/health"))
        again = toy.run("sling", "ui")
        assert again == (0, [f"the UI of this project runs already: {address}"])
        assert toy.flow()[0] == 0
        filters = json.dumps({}).encode()
        runs = json.loads(answer(f"{address}/api/flow_runs/filter", filters))
        assert [run["state_name"] for run in runs] == ["Completed"]
        settings = json.loads(answer(f"{address}/api/admin/settings"))
        assert settings["server"]["analytics_enabled"] is False
        other = Toy(tmp_path / "other", {})
        status, lines = other.run("sling", "ui", "--port", str(port))
        assert status == 1 and len(lines) == 1 and "Address already in use" in lines[0]
    finally:
        toy.end(ui)
    assert not toy.processes()


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


def answer(url: str, body: bytes | None = None) -> bytes:
    """What a server answers; empty where nobody does."""
    request = urllib.request.Request(url, body, {"Content-Type": "application/json"})
    try:
        with urllib.request.urlopen(request, timeout=5) as reply:
            return reply.read()
    except OSError:
        return b""
