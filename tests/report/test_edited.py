"""Files of a band edited by a careless hand: read as ever, or one clear line names the file."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from copy import deepcopy
from pathlib import Path

import pytest

from pipeline.report.report import write
from sling2sim2real.base.errors import UserError
from sling2sim2real.identification.results.theta import load_sling
from tests.report.conftest import PAIR

GONE = object()
JUNK = (GONE, None, float("nan"), -1e300, "<script>\x1b[2J\n", [], {}, True, [[1.0]], 10**400)


def edits(content: dict) -> Iterator[tuple[str, dict]]:
    """What was done, and the content: each value, at any depth, gone or replaced by each of JUNK.

    Also with a key that nobody knows, and of another type than an object.
    """
    yield "unknown key", {**content, "\x1b[2J<b>": 1}
    for path in _paths(content, ()):
        for junk in JUNK:
            edited = deepcopy(content)
            place = edited
            for key in path[:-1]:
                place = place[key]
            if junk is GONE:
                del place[path[-1]]
            else:
                place[path[-1]] = junk
            shown = "gone" if junk is GONE else f"{junk!r:.20}"
            yield f"{'.'.join(map(str, path))}: {shown}", edited
    yield "no object", [content]


def outcomes(path: Path, content: dict, ask: Callable[[], object]) -> tuple[int, int]:
    """How many edits of a file `ask` takes, and how many it refuses in one line that names it."""
    taken = refused = 0
    path.parent.mkdir(parents=True, exist_ok=True)
    for what, edited in edits(content):
        path.write_text(json.dumps(edited))
        try:
            ask()
            taken += 1
        except UserError as error:
            line = str(error)
            assert str(path) in line and line.isprintable() and len(line) < 500, what
            refused += 1
        except Exception as error:
            pytest.fail(f"{what}: {error!r}")
    return taken, refused


def _paths(value: object, above: tuple) -> Iterator[tuple]:
    """Of all values below; of a list its first is enough, and so it is within objects alike."""
    if isinstance(value, dict):
        keys = list(value)
    else:
        keys = [0] if isinstance(value, list) and value else []
    kinds = []
    for key in keys:
        yield (*above, key)
        kind = list(value[key]) if isinstance(value[key], dict) else None
        if kind is None or kind not in kinds:
            yield from _paths(value[key], (*above, key))
        kinds.append(kind)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["theta/{}", "clusters/{}", "policies/{}/card"])
def test_any_edit_is_one_line_or_a_report(name, root, params, no_simulation, text_alone) -> None:
    path = root / f"data/{name.format(PAIR)}.json"
    content = json.loads(path.read_text())
    accepted, refused = outcomes(path, content, lambda: write(params, root))
    assert refused > accepted > 0


def test_the_calibration_of_clamps(params, tmp_path: Path) -> None:
    path = tmp_path / "clamps.json"
    content = {"clamp_direction": [0.6, 0.0, -0.8], "flexural_rigidity": 2e-3}
    read, refused = outcomes(path, content, lambda: load_sling(params, "toy", path))
    assert refused > 20 and read == 1  # with a key that nobody knows
