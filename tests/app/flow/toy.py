"""A small DVC project: stages that sleep, note when, and write what follows from what they read."""

import copy
import json
import shutil
from pathlib import Path

from ruamel.yaml import YAML

from validation.projects import ProjectCopy

# Writes the first line of everything it reads, so that another second line changes nothing.
WORK = """
import json, os, pathlib, sys, time
name, seconds, *sources = sys.argv[1:]
begin = time.time()
print(f"{name} works", flush=True)
if seconds.startswith("@"):  # until that one works too
    pathlib.Path(name + ".here").touch()
    while not pathlib.Path(seconds[1:] + ".here").exists() and time.time() < begin + 90:
        time.sleep(0.05)
else:
    time.sleep(float(seconds))
firsts = []
for source in sources:
    lines = pathlib.Path(source).read_text().splitlines()
    if lines[0] == "bad":
        print(f"error: {source}: says bad; write something else", file=sys.stderr)
        sys.exit(1)
    firsts.append(lines[0])
pathlib.Path(name + ".out").write_text(" ".join(firsts) + "\\n")
note = {"begin": begin, "end": time.time(), "environment": dict(os.environ)}
pathlib.Path("notes").mkdir(exist_ok=True)
pathlib.Path("notes", name + ".json").write_text(json.dumps(note))
"""


def stage(name: str, *sources: str, seconds: float | str = 0.0, **more) -> dict:
    """An entry of dvc.yaml: reads `sources`, writes NAME.out.

    Args:
        seconds: How long it takes; or @ and the name of one that must be at work meanwhile.
    """
    command = " ".join(["python work.py", name, str(seconds), *sources])
    return {"cmd": command, "deps": ["work.py", *sources], "outs": [f"{name}.out"], **more}


class Toy(ProjectCopy):
    """The project in `folder`; its inputs are files with one word a line."""

    def __init__(self, folder: Path, stages: dict, work: str = WORK, **inputs: str) -> None:
        super().__init__(folder)
        (folder / ".dvc").mkdir(parents=True)
        settings = "[core]\n analytics = false\n check_update = false\n no_scm = true\n"
        (folder / ".dvc/config").write_text(settings)
        (folder / ".dvc/.gitignore").write_text("/config.local\n/tmp\n/cache\n")
        for name, text in {"work.py": work, **inputs}.items():
            (folder / name).write_text(text)
        YAML().dump({"stages": stages}, folder / "dvc.yaml")

    def copy(self, folder: Path) -> "Toy":
        """The project as it is, in another folder."""
        shutil.copytree(self.folder, folder)
        other = copy.copy(self)
        other.folder = folder
        return other

    def note(self, name: str) -> dict:
        """When a stage began and ended last, and in which environment."""
        return json.loads((self.folder / "notes" / f"{name}.json").read_text())

    def ran(self) -> set[str]:
        """Outputs whose stages left a note since this was asked last."""
        notes = [*(self.folder / "notes").glob("*.json")]
        for path in notes:
            path.unlink()
        return {path.stem for path in notes}
