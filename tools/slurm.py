"""A Dask cluster of SLURM jobs, as docs/cluster/jobqueue.yaml has them, for `sling flow --cluster`.

    python tools/slurm.py --jobs 4       says the scheduler's address; ends its jobs on Ctrl-C
    python tools/slurm.py --script       prints the job that sbatch would get

To be started in the project's folder, where its jobs work too.
"""

from __future__ import annotations

import argparse
import signal
from contextlib import suppress
from pathlib import Path

CONFIG = Path("docs/cluster/jobqueue.yaml")


def main() -> None:
    parser = argparse.ArgumentParser(description="start SLURM jobs that run stages")
    parser.add_argument("--jobs", type=int, default=1, help="how many, 1")
    parser.add_argument("--config", type=Path, default=CONFIG, help=str(CONFIG))
    parser.add_argument("--host", help="where the scheduler listens, else as config's interface")
    parser.add_argument("--script", action="store_true", help="print the job, start nothing")
    arguments = parser.parse_args()
    if not arguments.config.is_file():
        parser.error(f"{arguments.config}: missing; start this in the project's folder")

    try:
        import dask
        from dask_jobqueue import SLURMCluster
    except ModuleNotFoundError:
        parser.error("dask-jobqueue is missing; install it: pip install -e '.[cluster]'")

    jobs = dask.config.collect(paths=[str(arguments.config)], env={})
    dask.config.update(dask.config.config, jobs)
    listens = {"host": arguments.host} if arguments.host else {}
    with SLURMCluster(scheduler_options={**listens, "dashboard": False}) as cluster:
        if arguments.script:
            print(cluster.job_script())
            return
        cluster.scale(jobs=arguments.jobs)
        print(f"sling flow --cluster {cluster.scheduler_address}", flush=True)
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        with suppress(KeyboardInterrupt):
            signal.pause()


if __name__ == "__main__":
    main()
