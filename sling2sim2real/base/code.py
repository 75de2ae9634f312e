"""What code a result depends on: the folders that a script imports.

Python's imports are followed at any depth and inside functions too. `tools/closure.py` compares
them with dvc.yaml.
"""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).parents[2]
CODE = ("pipeline/", "rig/", "stages/", "sling2sim2real/", "validation/")
UNTRACKED = (  # nobody's dependency: see tools/closure.py
    "sling2sim2real/settings/",
    "pipeline/params/",
    "pipeline/layout.py",
    "stages/start.py",
)
NESTED = (  # folders of folders: what lies in them is a concern by itself, be it folder or file
    "sling2sim2real/",
    "sling2sim2real/identification/",
    "sling2sim2real/identification/searches/",
    "pipeline/",
    "rig/",
)
NATIVE = (".h", ".cpp", ".css", ".js", ".j2")


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
    modules: set[Path] = set()
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
        modules.update(file for name in names for file in files_of(name, root))
    return modules


def closure(script: Path, root: Path = ROOT) -> list[str]:
    """All project files that `script` may run, itself included, sorted, relative to `root`.

    What only UNTRACKED files import checks values of params.yaml, and is left out.
    """
    seen: set[Path] = set()
    queue = {script}
    while queue:
        file = queue.pop()
        seen.add(file)
        if not file.relative_to(root).as_posix().startswith(UNTRACKED):
            queue |= imports(file, root) - seen
    native = {
        beside for file in seen for beside in file.parent.iterdir() if beside.suffix in NATIVE
    }
    return sorted(file.relative_to(root).as_posix() for file in seen | native)


def concern(file: str) -> str:
    """What a file counts to, relative to the root: the outermost folder that is not NESTED.

    A script of validation/ knows little of the others and is a concern by itself.
    """
    if file.startswith("validation/"):
        return file
    top = max((name for name in NESTED if file.startswith(name)), key=len, default="")
    return "/".join(file.split("/")[: top.count("/") + 1 if top else 2])
