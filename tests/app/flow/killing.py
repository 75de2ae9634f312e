"""Toy stages that take their time, and all processes of a run, whoever their parents are by now."""

import signal
import subprocess
import sys
import uuid
from pathlib import Path

import psutil

from tests import project
from tests.app.flow import toy
from tests.project import environment, wait

SLING = [sys.executable, *project.SLING]
PROMPT = 10.0  # s after which nothing of a run may live
STEPS = 16
STAGES = {
    "count": {
        "matrix": {"item": ["a", "b"]},
        "cmd": "python work.py ${item.item}",
        "deps": ["work.py"],
        "outs": ["out/${item.item}.txt"],
    },
    "both": {
        "cmd": "cat out/a.txt out/b.txt > out/both.txt",
        "deps": ["out/a.txt", "out/b.txt"],
        "outs": ["out/both.txt"],
    },
}
# Counts in tenths of a second from where it was killed; a process of its own waits beside it.
WORK = f"""\
import os, signal, subprocess, sys, time
from pathlib import Path
from pipeline.base import errors
from pipeline.base.files import write_text

def main():
    (name,), size = sys.argv[1:], int(os.environ.get("SIZE", 100))
    helper = subprocess.Popen(["sleep", "300"])
    kept = Path(".checkpoints", name)
    count = int(kept.read_text()) if kept.is_file() else 0
    while count < {STEPS}:
        time.sleep(float(os.environ.get("PACE", 0.2)))
        count += 1
        write_text(kept, str(count))
        print(f"step {{count}}", flush=True)
        if os.environ.get("ABORT") == name and count == 3:
            os.abort()
    helper.kill()
    helper.wait()
    write_text(Path("out", f"{{name}}.txt"), name * size + "\\n")

errors.run(main)
"""
OUTPUTS = {f"out/{name}.txt": f"{name * 100}\n" for name in "ab"}
OUTPUTS["out/both.txt"] = "".join(OUTPUTS.values())


class Toy(toy.Toy):
    """A project of three stages in a folder, and all that runs there."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, STAGES, WORK)
        (folder / "out").mkdir()
        self.run = Run(folder, DVC_SITE_CACHE_DIR=self.environment["DVC_SITE_CACHE_DIR"])
        self.environment = self.run.environment

    def outputs(self) -> dict[str, str]:
        files = (self.folder / "out").iterdir()
        return {str(file.relative_to(self.folder)): file.read_text() for file in files}


class Run:
    """Commands in a folder, whose processes all bear a mark in their environment."""

    def __init__(self, folder: Path, log: Path | None = None, **more: str) -> None:
        self.folder, self.mark = folder, uuid.uuid4().hex
        self.log = log or folder.parent / "said.txt"
        self.environment = environment(SLING_TEST_RUN=self.mark, **more)

    def start(self, *command: str) -> subprocess.Popen:
        """In a session of its own; its lines, errors among them, go to `log`."""
        with self.log.open("w") as said:
            return subprocess.Popen(
                command, cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL,
                stdout=said, stderr=subprocess.STDOUT, start_new_session=True,
            )  # fmt: skip

    @property
    def said(self) -> str:
        return self.log.read_text(errors="replace")

    def alive(self) -> list[psutil.Process]:
        """Zombies apart, which wait for a parent to look at them."""
        found = []
        for process in psutil.process_iter():
            try:
                if process.status() == psutil.STATUS_ZOMBIE:
                    continue
                if process.environ().get("SLING_TEST_RUN") == self.mark:
                    found.append(process)
            except (psutil.NoSuchProcess, psutil.AccessDenied):
                continue
        return found

    def named(self, word: str) -> list[psutil.Process]:
        """Processes with `word` in their command line."""
        return [process for process in self.alive() if word in told(process)]

    def left(self, seconds: float = PROMPT) -> list[str]:
        """Commands of what still lives after so long; what does is killed then."""
        wait(lambda: not self.alive(), seconds)
        left = self.alive()
        said = [told(process) for process in left]
        for process in left:
            send(process)
        return said


def told(process: psutil.Process) -> str:
    """The command line, empty if the process has just ended."""
    try:
        return " ".join(process.cmdline())
    except psutil.NoSuchProcess:
        return ""


def send(process: psutil.Process, number: int = signal.SIGKILL) -> None:
    """A signal to what may have ended by now."""
    try:
        process.send_signal(number)
    except psutil.NoSuchProcess:
        pass
