"""Which folders of code does a stage run? Says where dvc.yaml lists others; exit status 1 then.

DVC re-runs a stage when something listed changes; it cannot see Python's imports. This follows what
a stage's script imports, at any depth and inside functions too, and takes the folder of each such
file: one folder a concern. Some files are nobody's dependency, for no result depends on them but by
what DVC tracks by itself: the models of params.yaml, which has each key; the layout, which
spells dvc.yaml's paths; and stages/start.py, which reads the arguments. Searches are found by
name, so that no import says which of them a stage runs: their files are listed by hand.
"""

from __future__ import annotations

import sys
from pathlib import Path

from ruamel.yaml import YAML

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from sling2sim2real.base.code import CODE, UNTRACKED, closure, concern  # noqa: E402

SEARCHES = "sling2sim2real/identification/searches"
BY_NAME = {"history": f"{SEARCHES}/de.py", "search": f"{SEARCHES}/${{item.search}}.py"}


def folders(script: Path, root: Path = ROOT) -> list[str]:
    """The concerns that `script` runs, as dvc.yaml lists them: folders, and the script itself."""
    paths = {script.relative_to(root).as_posix()}
    for file in closure(script, root):
        if not file.startswith(UNTRACKED) and not file.endswith("/__init__.py"):
            paths.add(concern(file))
    return sorted(paths)


def stages() -> dict[str, dict]:
    """dvc.yaml's stages, without what they are for each of."""
    content = YAML(typ="safe").load(ROOT / "dvc.yaml")["stages"]
    return {name: stage.get("do", stage) for name, stage in content.items()}


def script_of(stage: dict, root: Path = ROOT) -> Path:
    """The script of `sh stages/run.sh NAME ...`."""
    return root / "stages" / f"{stage['cmd'].split()[2]}.py"


def main() -> int:
    stale = False
    for name, stage in stages().items():
        listed = {dep for dep in stage["deps"] if dep.startswith(CODE)}
        run = {*folders(script_of(stage)), *filter(None, [BY_NAME.get(name)])}
        for part in sorted(listed ^ run):
            print(f"{name}: {'-' if part in listed else '+'} {part}")
            stale = True
    return int(stale)


if __name__ == "__main__":
    sys.exit(main())
