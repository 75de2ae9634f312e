"""Stages on Dask workers: a toy project in working copies of its own, a scheduler, a DVC remote."""

import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from app.cluster import cluster, exchange, worker
from app.flow import child
from pipeline.base.errors import UserError
from tests.app.cluster.several import Copy, Several, toy
from tests.project import alive, until


@pytest.fixture(scope="module")
def several(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Several]:
    several = None
    try:
        several = Several(tmp_path_factory.mktemp("several"))
        yield several
    finally:
        if several:
            several.dask.stop()


@pytest.mark.slow
def test_two_workers_with_copies_of_their_own_make_everything(several: Several) -> None:
    head, flow = several.head, ("-c", "from app.cli import main; main()", "flow")
    for copy in (several.plain, several.gpu):
        (copy.folder / "wait").touch()
    with ThreadPoolExecutor(1) as pool:
        done = pool.submit(head, sys.executable, *flow, "--cluster", several.address)
        try:
            until(lambda: several.plain.ran and several.gpu.ran, 120)  # both are at work
        finally:
            for copy in (several.plain, several.gpu):
                (copy.folder / "wait").unlink()
        done.result()
    lines = head.errors.splitlines()
    outputs = [row[0] for copy in (several.plain, several.gpu, head) for row in copy.ran]
    assert sorted(outputs) == ["data/search/a", "data/search/b", "data/train/b", "report.md"]
    assert [row[0] for row in several.plain.ran] in (["data/search/a"], ["data/search/b"])
    trained = [(row[0], row[2]) for row in several.gpu.ran if "train" in row[0]]
    assert trained == [("data/train/b", "cuda:7")]
    assert [row[0] for row in head.ran] == ["report.md"]  # what Git keeps
    assert "train | makes data/train/b" in lines
    for copy in (several.plain, several.gpu):
        assert f" in {copy.folder}\n" in "\n".join(lines)
    # What DVC itself says of the head: nothing to do.
    assert "Running stage" not in head("dvc", "repro")
    report = "".join(f"seed: 1\ndata/search/{letter}\n" for letter in "ab")
    assert (head.folder / "report.md").read_text() == f"{report}data/train/b\nreport.md\n"
    assert not list((head.folder / ".checkpoints").iterdir())
    # And a third copy can have it all.
    other = head.clone("other")
    (other.folder / "dvc.lock").write_text((head.folder / "dvc.lock").read_text())
    other("dvc", "pull", "-q", "train")
    assert (other.folder / "data/train/b").read_text() == "seed: 1\ndata/search/b\ndata/train/b\n"


@pytest.mark.slow
def test_a_stage_whose_worker_is_killed_begins_anew_on_the_other(several: Several) -> None:
    """After the test above, as the workers are the same: the worker with the GPU stays dead."""
    copies = {"plain": several.plain, "gpu": several.gpu}
    for copy in (several.head, *copies.values()):
        (copy.folder / "params.yaml").write_text("seed: 2\n")
        (copy.folder / "ran.log").unlink(missing_ok=True)
    (several.gpu.folder / "wait").touch()
    (several.plain.folder / "wait").touch()
    lines: list[str] = []
    with (
        cluster.Cluster(several.head.folder, several.address) as place,
        ThreadPoolExecutor(1) as pool,
    ):
        done = pool.submit(
            place.run_stage, place.root, "search@a", environment={}, on_line=lines.append
        )
        first = until(lambda: next((name for name in copies if copies[name].ran), None))
        other = "gpu" if first == "plain" else "plain"
        pid = int(copies[first].ran[0][1])
        (copies[other].folder / "wait").unlink()
        several.dask.processes[first].send_signal(signal.SIGKILL)
        assert done.result(timeout=60) is True
    assert [name for name, *_ in copies[other].ran] == ["data/search/a"]
    until(lambda: not alive(pid), 15)  # its processes ended with it
    assert (several.head.folder / "data/search/a").read_text() == "seed: 2\ndata/search/a\n"


@pytest.fixture
def copies(tmp_path: Path) -> tuple[Copy, Copy]:
    """The head and a worker's copy."""
    head = toy(tmp_path / "head")
    return head, head.clone("worker")


@pytest.fixture
def place(copies, monkeypatch) -> Iterator[Callable[[Path], cluster.Cluster]]:
    """Makes the head's cluster, of one worker in this process that works in the folder given."""
    from distributed import LocalCluster

    head = copies[0]
    monkeypatch.setenv("DVC_SITE_CACHE_DIR", head.environment["DVC_SITE_CACHE_DIR"])
    with LocalCluster(
        1,
        threads_per_worker=2,
        processes=False,
        protocol="tcp://",
        host="127.0.0.1",
        dashboard_address="127.0.0.1:0",
    ) as local:
        made = []

        def make(folder: Path) -> cluster.Cluster:
            monkeypatch.setenv("SLING_COPY", str(folder))
            made.append(cluster.Cluster(head.folder, local.scheduler_address))
            return made[-1]

        yield make
        for opened in made:
            opened.__exit__()


def run(place: cluster.Cluster, name: str, **options) -> tuple[bool, list[str]]:
    lines: list[str] = []
    ran = place.run_stage(place.root, name, environment={}, on_line=lines.append, **options)
    return ran, lines


def test_in_a_shared_folder_nothing_travels(copies, place, tmp_path: Path) -> None:
    head = copies[0]
    tokens, place = head.folder / ".checkpoints", place(head.folder)
    assert not tokens.exists()  # before the flow knows that this is a project, and its own
    tokens.mkdir()
    (tokens / "cluster-killed").touch()
    ran, lines = run(place, "search@a")
    assert [token.name for token in tokens.iterdir()] == [Path(place.token).name]
    assert ran and "makes data/search/a" in lines
    assert "search@a" in exchange.entries(head.folder, ("search@a",))
    assert not (tmp_path / "remote").exists()


def test_what_the_head_alone_has_is_pushed_first(copies, place) -> None:
    head, other = copies
    head("dvc", "repro", "-q", "search@b")
    ran, lines = run(place(other.folder), "train")
    assert ran
    assert [row[0] for row in other.ran] == ["data/train/b"]
    assert any(line.startswith("no worker offers GPU") for line in lines)
    assert (head.folder / "data/train/b").read_text() == "seed: 1\ndata/search/b\ndata/train/b\n"
    assert "Running stage" not in head("dvc", "repro", "train")


def test_a_worker_mends_what_a_killed_one_left_in_its_copy(copies, place) -> None:
    head, other = copies
    other("dvc", "repro", "-q", "search@b")
    lock = other.folder / "dvc.lock"
    lock.write_text(lock.read_text().rpartition(":")[0])  # a word that ends nothing
    ran, _ = run(place(other.folder), "search@a")
    assert ran and (head.folder / "data/search/a").is_file()


def test_a_copy_with_other_code_or_none_is_refused(copies, place, tmp_path: Path) -> None:
    other = copies[1]
    (other.folder / "step.py").write_text("pass\n")
    with pytest.raises(
        UserError, match="search@a: refused by worker tcp.* step.py differs"
    ) as error:
        run(place(other.folder), "search@a")
    assert "git pull" in str(error.value) and str(other.folder) in str(error.value)
    assert "\n" not in str(error.value)
    assert not other.ran and not (other.folder / "dvc.lock").exists()
    with pytest.raises(UserError, match="is no working copy .*SLING_COPY"):
        run(place(tmp_path), "search@a")


def test_a_stage_that_fails_says_why(copies, place, monkeypatch) -> None:
    monkeypatch.setenv("FAIL", "1")
    with pytest.raises(child.StageFailed, match="search@a: it fails"):
        run(place(copies[1].folder), "search@a")
    assert not exchange.entries(copies[0].folder, ("search@a",))


def test_a_cancelled_stage_ends_on_its_worker(copies, place) -> None:
    head, other = copies
    (other.folder / "wait").touch()
    here = place(other.folder)
    with pytest.raises(child.Cancelled):
        run(here, "search@a", cancelled=lambda: bool(other.ran))
    assert not alive(int(other.ran[0][1]))
    (other.folder / "wait").unlink()
    assert run(here, "search@a")[0]  # no lock is left
    assert (head.folder / "data/search/a").exists()


def test_a_stage_ends_when_its_head_is_killed(copies, place) -> None:
    head, other = copies
    (other.folder / "wait").touch()
    address = place(other.folder).address
    code = (
        "import sys, pathlib; from app.cluster.cluster import Cluster;"
        f"Cluster(pathlib.Path.cwd(), {address!r}).run_stage(pathlib.Path.cwd(), 'search@a',"
        " environment={}, on_line=print)"
    )
    process = subprocess.Popen([sys.executable, "-c", code], cwd=head.folder, env=head.environment)
    try:
        until(lambda: other.ran)
    finally:
        process.kill()
        process.wait()
    until(lambda: not alive(int(other.ran[0][1])), 15)


def test_a_remote_that_is_not_there_is_named(copies, place) -> None:
    head, other = copies
    for copy in copies:
        copy("dvc", "config", "--unset", "core.remote")
    with pytest.raises(UserError, match=f"{head.folder}: no default DVC remote"):
        run(place(other.folder), "search@a")
    assert not other.ran


def test_an_address_without_a_scheduler_is_one_line(monkeypatch) -> None:
    assert cluster.ANSWER <= 10
    monkeypatch.setattr(cluster, "ANSWER", 1.0)
    for address in ("tcp://127.0.0.1:9", "nonsense"):
        with pytest.raises(UserError, match=f"no Dask scheduler answers at {address}") as error:
            cluster.connect(address)
        assert "\n" not in str(error.value)


def test_versions_that_differ_are_named() -> None:
    ours = {"python": "3.11.2", "numpy": "2.1", "scipy": "1.15", "only-here": "1"}
    theirs = {"python": "3.11.9", "numpy": "2.1", "scipy": "1.16", "only-there": "1"}
    assert cluster.differences(ours, ours) == ""
    assert (
        cluster.differences(ours, theirs) == "python 3.11.9 (here 3.11.2), scipy 1.16 (here 1.15)"
    )
    assert cluster.differences(ours, theirs, most=1) == "python 3.11.9 (here 3.11.2) and 1 more"
    assert worker.versions()["numpy"] == __import__("numpy").__version__


def test_what_a_stage_waits_for_is_said() -> None:
    workers = {"tcp://one": {"resources": {}}, "tcp://two": {"resources": {"GPU": 1.0}}}
    assert cluster.waits(workers, "tcp://one", {}) == ""
    assert cluster.waits(workers, "", {}) == "waits for a free worker"
    assert cluster.waits({}, "", {}) == "waits for a worker"
    del workers["tcp://two"]
    assert cluster.waits(workers, "", {"GPU": 1}) == "waits for a worker with GPU"
    assert "tcp://two is gone" in cluster.waits(workers, "tcp://two", {})
