"""What the campaigns share: a line of progress, and the JSON file that each leaves for the record.

A campaign writes its file before it asserts, so that a claim that fails leaves its figures too.
"""

from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import pytest

from pipeline.base.files import write_json
from pipeline.params import load
from validation.benchmarks.timing import environment

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def params():
    return load(ROOT / "params.yaml")


@pytest.fixture
def progress(capsys) -> Callable[[str], None]:
    """Print a line at once, though pytest holds back what tests print."""

    def say(line: str) -> None:
        with capsys.disabled():
            print(line, flush=True)

    return say


@pytest.fixture
def record(request) -> Callable[..., None]:
    """Write reports/validation/<name>.json.

    `code` in it has digests of what the campaign imports, and what `also`, scripts that it runs as
    processes, do: `sling figures` tells which are older.
    """

    def write(
        name: str,
        *,
        asked: str,
        met: bool,
        settings: dict,
        figures: dict,
        also: Iterable[Path] = (),
    ) -> None:
        about = environment("cpu", "make validate", request.path, *also) | {
            "alone": "python -m pytest -m validation -n 0"
            f" validation/campaigns/{request.path.name}",
        }
        content = {"asked": asked, "met": met, "settings": settings, "figures": figures, **about}
        write_json(ROOT / "reports/validation" / f"{name}.json", _plain(content))

    return write


def _plain(value):
    """For JSON: NumPy's numbers as Python's, floats to five digits, what is not finite as null."""
    if isinstance(value, dict):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [_plain(one) for one in value]
    if isinstance(value, (float, np.floating)):
        return float(f"{value:.5g}") if np.isfinite(value) else None
    return value.item() if isinstance(value, np.generic) else value
