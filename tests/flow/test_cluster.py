"""`sling flow --dask` on a Dask cluster of two workers in a shared folder."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipeline.flow import cluster
from sling2sim2real.base.errors import UserError
from tests.flow.toy import MEET, Toy, stage
from tests.project import until

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[2]
# A stage of the toy: writes its name, after it has waited for another one at work.
SCRIPT = """
import subprocess, sys, time
name, other = sys.argv[1:]
print("error: bad" if name == "bad" else f"{name} at work")
if name == "bad":
    sys.exit(1)
if name == "endless":
    open("begun", "w").close()
    time.sleep(300)
subprocess.run(MEET.format(name, other), shell=True, check=True)
open(f"{name}.txt", "w").write(name)
"""


def remote(name: str, other: str) -> dict:
    return stage(f"sh stages/run.sh work {name} {other}", f"{name}.txt")


@pytest.fixture(scope="module")
def toy(tmp_path_factory: pytest.TempPathFactory) -> Toy:
    toy = Toy(tmp_path_factory.mktemp("shared"), {})
    (toy.folder / "stages").mkdir()
    shutil.copy(ROOT / "stages/run.sh", toy.folder / "stages")
    (toy.folder / "stages/work.py").write_text(f"MEET = {MEET!r}\n{SCRIPT}")
    return toy


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """Of a scheduler with two workers, of one thread each."""
    from distributed import LocalCluster

    workers = {"n_workers": 2, "threads_per_worker": 1, "processes": True}
    with LocalCluster(**workers, dashboard_address=None) as dask:
        yield dask.scheduler_address


def test_two_workers_run_stages_side_by_side(toy: Toy, address: str) -> None:
    stages = {
        "left": remote("left", "right"),
        "right": remote("right", "left"),
        "sum": stage("cat left.txt right.txt > sum.txt", "sum.txt", "left.txt", "right.txt"),
    }
    toy.write(stages)
    status, lines = toy.flow("--dask", address)
    assert status == 0 and lines[-1].startswith("stages: 3 Completed ("), lines
    assert {"left | left at work", "right | right at work"} <= {*lines}
    assert toy.read("sum.txt") == "leftright"
    assert toy.run("dvc", "status")[1] == ["Data and pipelines are up to date."]


def test_a_failure_on_a_worker_is_one_line_and_an_interrupt_ends_its_stage(
    toy: Toy, address: str
) -> None:
    toy.write({"bad": remote("bad", "none")})
    status, lines = toy.flow("--dask", address)
    assert status == 1 and lines[-1].endswith("; bad: bad"), lines
    toy.write({"endless": remote("endless", "none")})
    flow = toy.start("sling", "flow", "--dask", address)
    until((toy.folder / "begun").exists)
    assert toy.end(flow) == 130
    until(lambda: not [p for p in toy.processes() if "endless" in p.cmdline()], 20)


def test_no_scheduler_is_one_line() -> None:
    with pytest.raises(UserError, match="^no Dask scheduler answers at tcp://127.0.0.1:9: "):
        cluster.connected("tcp://127.0.0.1:9")


def test_slurm_jobs_are_as_the_file_says(tmp_path: Path) -> None:
    """By dask-jobqueue's own script of a job, with the file that the page shows."""
    from dask_jobqueue import SLURMCluster

    with cluster.there(None, ROOT / "docs/cluster/jobqueue.yaml") as environment:
        assert environment["SLING_DASK"].startswith("tcp://")
        script = SLURMCluster(scheduler_options={"dashboard": False}).job_script()
    assert "--gres=gpu:1" in script
    assert "export SLING_DEVICE=cuda:0 SLING_WORKERS=4" in script
