"""A small DVC project of shell commands, and `sling flow` in it."""

import os
import signal
import sqlite3
import subprocess
import sys
from pathlib import Path

import psutil
from ruamel.yaml import YAML

from tests.project import ROOT

BIN = Path(sys.executable).parent
# Waits until another stage is at work too: two such stages end only side by side.
MEET = "touch {0}.here; for i in $(seq 600); do [ -e {1}.here ] && break; sleep 0.1; done"


def stage(command: str, out: str, *deps: str, **more: object) -> dict:
    """An entry of dvc.yaml that runs a shell command, which writes `out`."""
    return {"cmd": command, "outs": [out], **({"deps": [*deps]} if deps else {}), **more}


class Toy:
    """The project in a folder, with Git."""

    def __init__(self, folder: Path, stages: dict) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        for command in ("git init -q", "dvc init -q", "dvc config core.analytics false"):
            subprocess.run(command.split(), cwd=folder, env=self.environment(), check=True)
        self.write(stages)

    def write(self, stages: dict) -> None:
        YAML().dump({"stages": stages}, self.folder / "dvc.yaml")

    def environment(self, **more: str) -> dict[str, str]:
        """Ours, with this Python's commands first and two cores."""
        foreign = [name for name in os.environ if name.startswith(("PREFECT", "SLING", "DVC"))]
        kept = {name: text for name, text in os.environ.items() if name not in foreign}
        ours = {"PATH": f"{BIN}:{kept['PATH']}", "PYTHONPATH": str(ROOT), "SLING_WORKERS": "2"}
        return kept | ours | more

    def start(self, *command: str, **environment: str) -> subprocess.Popen:
        """Start a command, its output together."""
        return subprocess.Popen(
            command,
            cwd=self.folder,
            env=self.environment(**environment),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def run(self, *command: str, **environment: str) -> tuple[int, list[str]]:
        """Exit status and lines of a command."""
        process = self.start(*command, **environment)
        output, _ = process.communicate(timeout=180)
        return process.returncode, output.splitlines()

    def flow(self, *arguments: str, **environment: str) -> tuple[int, list[str]]:
        return self.run("sling", "flow", *arguments, **environment)

    def read(self, name: str) -> str:
        return (self.folder / name).read_text().strip()

    def states(self) -> dict[str, str]:
        """By task run, the name of the state in which Prefect's database has it."""
        return dict(self.rows("select name, state_name from task_run order by created"))

    def rows(self, question: str) -> list[tuple]:
        """What Prefect's database answers."""
        with sqlite3.connect(self.folder / ".prefect" / "prefect.db") as database:
            return database.execute(question).fetchall()

    def processes(self) -> list[psutil.Process]:
        """Those that work in this folder."""
        found = []
        for process in psutil.process_iter(["cwd"]):
            if process.info["cwd"] == str(self.folder) and process.status() != "zombie":
                found.append(process)
        return found

    def end(self, process: subprocess.Popen, number: int = signal.SIGINT) -> int:
        """Signal a command and wait for it."""
        process.send_signal(number)
        return process.wait(60)
