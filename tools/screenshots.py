"""The pictures of docs/flow.md: a flow of a tiny project, as Prefect's UI shows it.

    python tools/screenshots.py [FOLDER]        # default docs/flow; some seven minutes on two cores

Needs a Chromium, and the packages of `make validate`. The UI is opened without a network: a page
that asks for anything that is not on this machine is an error.
"""

from __future__ import annotations

import contextlib
import json
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from pipeline.base import errors  # noqa: E402
from pipeline.base.errors import UserError  # noqa: E402
from tools.browser import Browser, browsing  # noqa: E402
from validation.projects import (  # noqa: E402
    SLING,
    TINY,
    ProjectCopy,
    copy_project,
    run_of,
)

BUDGET = {  # long enough to be looked at, and to converge
    "sling.edges": 24,
    "optimizer.population": 24,
    "optimizer.generations": 24,
    "optimizer.k_nn": 10,
    "optimizer.cma_population": 8,
    "optimizer.cma_rollouts": 192,
    "policy.map_size": [15, 15],
    "policy.envs": 256,
    "policy.iterations": 60,
    "trials.targets": [1.725, 1.925, 2.125],
    "trials.repeats": 3,
}
SECONDS = 600.0  # that any wait may last
STEM, BARS = "band1-sling2sim2real", (30, 95)  # whose pictures; % at which a bar is looked at


class Server:
    """The project's Prefect server, by its API."""

    def __init__(self, url: str) -> None:
        self.url = url

    def __call__(self, path: str, content: dict) -> list[dict]:
        request = urllib.request.Request(
            f"{self.url}/api/{path}",
            json.dumps(content).encode(),
            {"Content-Type": "application/json"},
        )
        with urllib.request.urlopen(request, timeout=60) as answer:
            return json.load(answer)

    def artifact(self, key: str) -> dict | None:
        """The newest of its key."""
        artifacts = self("artifacts/latest/filter", {"artifacts": {"key": {"any_": [key]}}})
        return artifacts[0] if artifacts else None

    def run(self) -> dict | None:
        """The newest flow run."""
        runs = self("flow_runs/filter", {"sort": "START_TIME_DESC", "limit": 1})
        return runs[0] if runs else None


def until(happens, what: str):
    deadline = time.monotonic() + SECONDS
    while time.monotonic() < deadline:
        with contextlib.suppress(OSError):
            if result := happens():
                return result
        time.sleep(0.3)
    raise UserError(f"in {SECONDS:g} s there was no {what}")


@contextlib.contextmanager
def serving(copy: ProjectCopy) -> Iterator[Server]:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        port = listener.getsockname()[1]
    command = [*SLING, "ui", "--port", str(port)]
    process = subprocess.Popen(command, cwd=copy.folder, env=copy.environment)
    server = Server(f"http://127.0.0.1:{port}")
    try:
        until(lambda: server("flow_runs/filter", {}) is not None, "server")
        yield server
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(60)


@contextlib.contextmanager
def flow(copy: ProjectCopy) -> Iterator[subprocess.Popen]:
    """A flow, which ends with the block."""
    command = [*SLING, "flow", "--workers", "2"]
    with (copy.folder.parent / "flow.log").open("a") as log:
        process = subprocess.Popen(
            command, cwd=copy.folder, env=copy.environment, stdout=log, stderr=log
        )
        try:
            yield process
        finally:
            process.terminate()
            process.wait(60)


def shoot(copy: ProjectCopy, server: Server, page: Browser, folder: Path) -> None:
    """Take all pictures."""

    def artifact(name: str, key: str, *texts: str, height: int | None = None) -> None:
        newest = until(lambda: server.artifact(key), f"artifact {key}")
        page.open(f"{server.url}/artifacts/artifact/{newest['latest_id']}", *texts)
        page.shoot(folder / f"{name}.png", height)

    def run(name: str, *texts: str) -> None:
        page.open(f"{server.url}/runs/flow-run/{server.run()['id']}", *texts, settling=8.0)
        page.shoot(folder / f"{name}.png", 800)

    page.page.add_init_script("localStorage.setItem('color-scheme', '\"light\"')")
    with flow(copy) as running:

        def searching() -> bool:
            bar = server.artifact(f"history-{STEM}")
            return running.poll() is not None or bar and BARS[0] <= bar["data"] <= BARS[1]

        until(searching, "search half done")
        artifact("progress", f"history-{STEM}", "rollouts", height=440)
        if running.wait(SECONDS):
            raise UserError(f"the flow failed; {copy.folder.parent / 'flow.log'} says why")
    run("run", "Completed", f"record@{STEM[:5]}")
    artifact("convergence", f"theta-{STEM}", "identified")
    artifact("trials", f"trials-{STEM}", "launches")

    measured = copy.folder / "data" / "trials" / "measured" / "band1.csv"
    measured.write_text("draw_y_m,draw_z_m,landing_y_m\n-0.30,-0.17,here\n")
    with flow(copy) as failing:
        if failing.wait(SECONDS) == 0:
            raise UserError("a flow with a damaged file of landings did not fail")
    run("failed", "Failed", "got 'here'")
    if elsewhere := page.elsewhere:
        raise UserError(f"the UI asked for {', '.join(sorted(elsewhere))}")


def main() -> None:
    folder = Path(sys.argv[1] if sys.argv[1:] else ROOT / "docs" / "flow")
    with tempfile.TemporaryDirectory() as place, browsing() as page:
        copy = ProjectCopy(Path(place, "copy"), SLING_WORKERS="1")
        copy_project(copy.folder)
        copy.set(TINY | run_of(["band1"], ["least_squares", "sling2sim2real"], ["de"]) | BUDGET)
        copy.commit()
        with serving(copy) as server:
            shoot(copy, server, page, folder)
    print(f"wrote {', '.join(sorted(str(path) for path in folder.glob('*.png')))}")


if __name__ == "__main__":
    errors.run(main)
