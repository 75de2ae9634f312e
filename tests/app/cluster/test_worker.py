"""What a stage finds on a Dask worker, and the jobs of SLURM that start such workers."""

import sys
from pathlib import Path

from app.cluster import worker
from tests.project import python


def test_threads_of_a_worker_share_its_cores(monkeypatch) -> None:
    monkeypatch.delenv("SLING_WORKERS", raising=False)
    monkeypatch.setenv("SHELL", "/usr/sbin/nologin")
    monkeypatch.setattr(worker.machine, "cores", lambda: 8)
    assert worker.environment(threads=3)["SLING_WORKERS"] == "2"
    assert worker.environment(threads=16)["OMP_NUM_THREADS"] == "1"
    assert worker.environment(threads=1)["SHELL"] == "/bin/sh"
    monkeypatch.setenv("SLING_WORKERS", "5")
    assert worker.environment(threads=3)["OMP_NUM_THREADS"] == "5"
    assert worker.environment(threads=3)["PATH"].startswith(str(Path(sys.executable).parent))


def test_the_jobs_of_slurm_are_as_documented(tmp_path: Path) -> None:
    """docs/cluster/jobqueue.yaml by Dask's own configuration, to the script that sbatch gets."""
    requested = ("tools/slurm.py", "--host", "127.0.0.1", "--script")
    done = python(*requested, DASK_CONFIG=str(tmp_path))
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    requested = "-J sling,-n 1,--cpus-per-task=16,--mem=60G,-t 08:00:00,--gres=gpu:1"
    assert {f"#SBATCH {directive}" for directive in requested.split(",")} <= {*lines}
    assert "export SLING_DEVICE=cuda:0 SLING_WORKERS=4" in lines
    (started,) = (line for line in lines if "distributed.cli.dask_worker" in line)
    assert started.startswith(f"{sys.executable} -m distributed.cli.dask_worker tcp://127.0.0.1:")
    for option in ("--nthreads 4", "--resources GPU=1"):
        assert option in started
