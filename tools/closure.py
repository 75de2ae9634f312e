"""Which folders of code does a stage run? Checks dvc.yaml's code dependencies, or mends them.

DVC re-runs a stage when something listed changes; it cannot see Python's imports. This follows what
a stage's script imports, at any depth and inside functions too, and lists the folder of each such
file: one folder a concern. Two things are nobody's dependency, for no result depends on them but
by the values in params.yaml, which DVC tracks by themselves: the models of its keys, each of
which stands there, and stages/start.py, which reads the arguments. Searches are found by name, so
that no import says which of them a stage runs: their files are listed by hand.

    python tools/closure.py          # says what differs; exit status 1 if anything does
    python tools/closure.py --fix    # rewrite the code dependencies, comments kept
"""

from __future__ import annotations

import argparse
import io
import re
import sys
from pathlib import Path

from ruamel.yaml import YAML

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from sling2sim2real.base.code import CODE, UNTRACKED, closure, concern  # noqa: E402

BY_NAME = "sling2sim2real/identification/searches/"


def folders(script: Path, root: Path = ROOT) -> list[str]:
    """The concerns that `script` runs, as dvc.yaml lists them: folders, and the script itself."""
    paths = {script.relative_to(root).as_posix()}
    for file in closure(script, root):
        if not file.startswith(UNTRACKED) and not file.endswith("/__init__.py"):
            paths.add(concern(file))
    return sorted(paths)


def script_of(stage: dict, root: Path = ROOT) -> Path:
    """The script of `sh stages/run.sh NAME ...`."""
    return root / "stages" / f"{stage['cmd'].split()[2]}.py"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--fix", action="store_true", help="rewrite dvc.yaml")
    fix = parser.parse_args().fix
    yaml = YAML()
    yaml.width, yaml.preserve_quotes = 100, True
    yaml.indent(mapping=2, sequence=4, offset=2)
    path = ROOT / "dvc.yaml"
    content = yaml.load(path)
    stale = False
    for name, stage in content["stages"].items():
        if not script_of(stage).is_file():
            print(f"{name}: there is no {script_of(stage).relative_to(ROOT)}")
            return 1
        listed = [dep for dep in stage["deps"] if dep.startswith(CODE)]
        by_hand = {dep for dep in listed if dep.startswith(BY_NAME)}
        code = sorted({*folders(script_of(stage)), *by_hand})
        for part in sorted(set(listed) ^ set(code)):
            print(f"{name}: {'-' if part in listed else '+'} {part}")
        stale |= listed != code
        stage["deps"][:] = [dep for dep in stage["deps"] if dep not in listed] + code
    if fix and stale:
        text = io.StringIO()
        yaml.dump(content, text)
        path.write_text(re.sub(" +$", "", text.getvalue(), flags=re.MULTILINE), encoding="utf-8")
    return int(stale and not fix)


if __name__ == "__main__":
    sys.exit(main())
