"""Toy stages that take their time, and all processes of their run."""

from pathlib import Path

from tests.app.flow import toy
from validation.projects import MarkedRun

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
        self.run = MarkedRun(folder, DVC_SITE_CACHE_DIR=self.environment["DVC_SITE_CACHE_DIR"])
        self.environment = self.run.environment

    def outputs(self) -> dict[str, str]:
        files = (self.folder / "out").iterdir()
        return {str(file.relative_to(self.folder)): file.read_text() for file in files}
