"""What the campaigns share: a line of progress, and the JSON file that each leaves for the record.

A campaign writes its file before it asserts, so that a claim that fails leaves its figures too.
"""

from collections.abc import Callable

import pytest

from pipeline.layout import ROOT
from pipeline.params import Params, load
from sling2sim2real.base.files import write_json
from validation.projects import DEFAULTS
from validation.reports import environment, plain


@pytest.fixture(scope="session")
def params() -> Params:
    return load(DEFAULTS)


@pytest.fixture
def progress(capsys) -> Callable[[str], None]:
    """Print a line at once, though pytest holds back what tests print."""

    def say(line: str) -> None:
        with capsys.disabled():
            print(line, flush=True)

    return say


@pytest.fixture
def record(request) -> Callable[..., None]:
    """Write reports/validation/<name>.json."""

    def write(name: str, *, requested: str, met: bool, settings: dict, figures: dict) -> None:
        content = {"asked": requested, "met": met, "settings": settings, "figures": figures}
        content |= environment("cpu", "make validate")
        options = "-m validation -n 0 --hypothesis-profile default"  # quick is that of tests/
        alone = f"python -m pytest {options} validation/campaigns/{request.path.name}"
        path = ROOT / "reports/validation" / f"{name}.json"
        write_json(path, plain(content | {"alone": alone}, digits=5))

    return write
