"""Which folders of code does a stage run? Checks dvc.yaml's code dependencies, or mends them.

DVC re-runs a stage when something listed changes; it cannot see Python's imports. This follows what
a stage's script imports, at any depth and inside functions too, and lists the folder of each such
file: one folder a concern. Two things are nobody's dependency, for no result hangs on them but by
the values in params.yaml, which DVC tracks by themselves: pipeline/params/, which holds no default,
and stages/start.py, which reads the arguments.

    python tools/closure.py          # says what differs; exit status 1 if anything does
    python tools/closure.py --fix    # rewrite the code dependencies, comments kept
"""

from __future__ import annotations

import argparse
import ast
import sys
from pathlib import Path

from ruamel.yaml import YAML

ROOT = Path(__file__).parents[1]
CODE = ("pipeline/", "stages/", "app/", "sling2sim2real/", "validation/")
UNTRACKED = ("pipeline/params/", "stages/start.py")
NESTED = ("pipeline/rig/",)  # folders whose own folders are concerns of their own
NATIVE = (".h", ".cpp", ".html", ".css", ".js")


def files_of(module: str, root: Path = ROOT) -> list[Path]:
    """Files that `import module` runs: the module and its packages; none if it is not ours."""
    parts = module.split(".")
    packages = [root.joinpath(*parts[:n], "__init__.py") for n in range(1, len(parts) + 1)]
    leaf = root.joinpath(*parts).with_suffix(".py")
    if not (leaf.is_file() or packages[-1].is_file()):
        return []
    return [file for file in (*packages, leaf) if file.is_file()]


class _WithoutTypes(ast.NodeTransformer):
    """Leaves out what `if TYPE_CHECKING:` imports: no program runs it."""

    def visit_If(self, node: ast.If) -> ast.AST | None:
        typed = isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
        return None if typed else self.generic_visit(node)


def imports(file: Path, root: Path = ROOT) -> set[Path]:
    """Project files that `file` imports itself, with native sources that lie beside a module."""
    package = file.relative_to(root).parent.parts
    found: set[Path] = set()
    tree = ast.parse(file.read_text(encoding="utf-8"), str(file))
    for node in ast.walk(_WithoutTypes().visit(tree)):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = [*package[: len(package) + 1 - node.level]] if node.level else []
            base = ".".join([*base, *filter(None, [node.module])])
            names = [base, *(f"{base}.{alias.name}" for alias in node.names)]
        else:
            continue
        found.update(file for name in names for file in files_of(name, root))
    return found


def closure(script: Path, root: Path = ROOT) -> list[str]:
    """All project files that `script` may run, itself included, sorted, relative to `root`."""
    seen: set[Path] = set()
    queue = {script}
    while queue:
        file = queue.pop()
        seen.add(file)
        queue |= imports(file, root) - seen
    native = {
        beside for file in seen for beside in file.parent.iterdir() if beside.suffix in NATIVE
    }
    return sorted(file.relative_to(root).as_posix() for file in seen | native)


def folders(script: Path, root: Path = ROOT) -> list[str]:
    """The concerns that `script` runs, as dvc.yaml lists them: folders, and the script itself."""
    found = {script.relative_to(root).as_posix()}
    for file in closure(script, root):
        parts = file.split("/")
        depth = 3 if file.startswith(NESTED) else 2
        if len(parts) > depth and not file.startswith(UNTRACKED):
            found.add("/".join(parts[:depth]))
    return sorted(found)


def script_of(stage: dict, root: Path = ROOT) -> Path:
    """The script of `python -m stages.NAME ...`."""
    return root / (stage["cmd"].split()[2].replace(".", "/") + ".py")


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
        code = folders(script_of(stage))
        listed = [dep for dep in stage["deps"] if dep.startswith(CODE)]
        for part in sorted(set(listed) ^ set(code)):
            print(f"{name}: {'-' if part in listed else '+'} {part}")
        stale |= listed != code
        stage["deps"][:] = [dep for dep in stage["deps"] if dep not in listed] + code
    if fix and stale:
        yaml.dump(content, path)
    return int(stale and not fix)


if __name__ == "__main__":
    sys.exit(main())
