"""The diagram of docs/architecture.md: who imports whom, without what follows from the rest.

python tools/architecture.py          # exit status 1 if the page is out of date
python tools/architecture.py --fix    # draw it anew
"""

from __future__ import annotations

import sys
from pathlib import Path

import networkx

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from pipeline.base.code import CODE, concern, imports  # noqa: E402
from validation.marked import compared_or_fixed, marks, with_block  # noqa: E402

PAGE = ROOT / "docs" / "architecture.md"
WHOLE = (
    "stages",
    "app",
    "sling2sim2real",
    "validation",
    "rig",
)  # each a box; the library is several
LEFT_OUT = ("pipeline/base", "pipeline/params")  # which all import
DEVELOPERS = "app/developer.py"  # may import validation/


def box(file: str) -> str:
    """The box of a file: a top-level package, or a folder of the library."""
    top = file.partition("/")[0]
    if top in WHOLE:
        return top
    folder = concern(file)
    return "/".join(folder.split("/")[:2]) if folder.count("/") > 1 else folder


def arrows() -> list[tuple[str, str]]:
    """List who imports whom, sorted: the transitive reduction of all imports."""
    graph = networkx.DiGraph()
    for file in sorted(file for top in CODE for file in (ROOT / top).rglob("*.py")):
        if file == ROOT / DEVELOPERS:
            continue
        here = box(file.relative_to(ROOT).as_posix())
        for other in imports(file):
            there = box(other.relative_to(ROOT).as_posix())
            if here != there and not there.endswith(".py") and there not in LEFT_OUT:
                graph.add_edge(here, there)
    graph.remove_nodes_from(LEFT_OUT)
    return sorted(networkx.transitive_reduction(graph).edges)


def diagram() -> str:
    """The arrows as Mermaid draws them."""
    lines = [f"  {name(a)}[{a}] --> {name(b)}[{b}]" for a, b in arrows()]
    return "\n".join(["```mermaid", "flowchart TD", *lines, "```", ""])


def name(folder: str) -> str:
    return folder.replace("/", "_")


def drawn(page: str) -> str:
    """The page with today's diagram."""
    begin, end = marks("imports")
    return with_block(page, begin + diagram() + end)


if __name__ == "__main__":
    sys.exit(compared_or_fixed(PAGE, drawn, __doc__))
