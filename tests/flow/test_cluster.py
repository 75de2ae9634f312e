"""`sling flow --dask` on a Dask cluster of two workers in a shared folder."""

import shutil
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipeline.base.errors import UserError
from pipeline.flow import cluster
from tests.flow.toy import MEET, Toy, stage, wait_until

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[2]
# A stage of the toy: writes its name, after it has waited for another one at work.
SCRIPT = """
import os, subprocess, sys, time
name, other = sys.argv[1:]
print("error: bad" if name == "bad" else f"{name} of {os.environ['SLING_WORKERS']}")
if name == "bad":
    sys.exit(1)
if name == "endless":
    open("begun", "w").close()
    time.sleep(300)
subprocess.run(MEET.format(name, other), shell=True, check=True)
open(f"{name}.txt", "w").write(name)
"""


def remote(name: str, other: str, *deps: str, **more: object) -> dict:
    return stage(f"sh stages/run.sh work {name} {other}", f"{name}.txt", *deps, **more)


@pytest.fixture(scope="module")
def toy(tmp_path_factory: pytest.TempPathFactory) -> Toy:
    toy = Toy(tmp_path_factory.mktemp("shared"), {})
    (toy.folder / "stages").mkdir()
    shutil.copy(ROOT / "stages/run.sh", toy.folder / "stages")
    (toy.folder / "stages/work.py").write_text(f"MEET = {MEET!r}\n{SCRIPT}")
    return toy


@pytest.fixture(scope="module")
def address(toy: Toy) -> Iterator[str]:
    """Of a scheduler with two workers, of one thread each; the second offers a GPU."""
    from distributed import LocalCluster

    workers = {"processes": True, "threads_per_worker": 1, "dashboard_address": None}
    with LocalCluster(n_workers=1, **workers) as dask:
        yield dask.scheduler_address


@pytest.fixture(scope="module")
def gpu_worker(toy: Toy, address: str) -> Iterator[None]:
    worker = toy.start(
        "dask", "worker", address, "--nthreads", "1", "--no-dashboard", "--resources", "GPU=1"
    )
    yield
    toy.end(worker, signal.SIGTERM)


@pytest.mark.usefixtures("gpu_worker")
def test_two_workers_run_stages_side_by_side(toy: Toy, address: str) -> None:
    stages = {
        "left": remote("left", "right"),
        "right": remote("right", "left", meta={"gpu": True}),
        "sum": stage("cat left.txt right.txt > sum.txt", "sum.txt", "left.txt", "right.txt"),
    }
    toy.write(stages)
    status, lines = toy.flow("--dask", address)
    assert status == 0 and lines[-1].startswith("stages: 3 ran ("), lines
    assert {line for line in lines if " of " in line} == {"left | left of 2", "right | right of 2"}
    assert toy.read("sum.txt") == "leftright"
    assert toy.run("dvc", "status")[1] == ["Data and pipelines are up to date."]


@pytest.mark.usefixtures("gpu_worker")
def test_a_failure_on_a_worker_is_one_line_and_an_interrupt_ends_its_stage(
    toy: Toy, address: str
) -> None:
    toy.write({"bad": remote("bad", "none")})
    status, lines = toy.flow("--dask", address)
    assert status == 1 and lines[-1].endswith("; bad: bad"), lines
    toy.write({"endless": remote("endless", "none")})
    flow = toy.start("sling", "flow", "--dask", address)
    wait_until((toy.folder / "begun").exists)
    assert toy.end(flow) == 130
    wait_until(lambda: not [p for p in toy.processes() if "endless" in p.cmdline()], 20)


def test_no_scheduler_is_one_line() -> None:
    with pytest.raises(UserError, match="^no Dask scheduler answers at tcp://127.0.0.1:9: "):
        cluster.connected("tcp://127.0.0.1:9")


def test_slurm_jobs_are_as_the_file_says(tmp_path: Path) -> None:
    """By dask-jobqueue's own script of a job, with the file that the page shows."""
    from dask_jobqueue import SLURMCluster

    with cluster.there(None, ROOT / "docs/cluster/jobqueue.yaml") as (environment, slots):
        assert environment["SLING_DASK"].startswith("tcp://") and slots
        script = SLURMCluster(scheduler_options={"dashboard": False}).job_script()
    assert "--gres=gpu:1" in script and "--resources GPU=1" in script
    assert "export SLING_DEVICE=cuda:0 SLING_WORKERS=4" in script
