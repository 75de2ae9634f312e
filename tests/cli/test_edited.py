"""Files edited by hand before a command reads them: an answer, or one clear line names the file."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from pipeline.params import load
from sling2sim2real.base.layout import Layout
from sling2sim2real.cli.launch import launch_output
from sling2sim2real.cli.observe import prediction_of
from sling2sim2real.exporting.export import replaceable
from tests.card.conftest import POINT, samples, theta_file
from tests.edited import edits, outcomes
from tests.project import DEFAULTS

BAND, METHOD, DRAW = "band1", "posterior", (-0.3, -0.15)


@pytest.fixture(scope="module")
def params():
    return load(DEFAULTS)


@pytest.fixture
def layout(tmp_path: Path) -> Layout:
    """A band that was identified."""
    layout = Layout(tmp_path)
    for path, content in (
        (layout.theta(BAND, METHOD), theta_file(BAND)),
        (layout.confidence(BAND, METHOD), {"names": [*POINT], "samples": samples()[:3].tolist()}),
        (layout.clamps(BAND), {"clamp_direction": [0.6, 0.0, -0.8], "flexural_rigidity": 2e-3}),
    ):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(content))
    return layout


def answers(path: Path, ask: Callable[[], dict]) -> int:
    """How many edits of a file are answered; all others must be refused."""

    def answer() -> None:
        json.dumps(ask() | {"warnings": []}, allow_nan=False)

    return outcomes(path, json.loads(path.read_text()), answer)[0]


@pytest.mark.parametrize("name", ["theta", "mounting"])
def test_launch(params, layout, name) -> None:
    theta = layout.theta(BAND, METHOD)
    path = theta if name == "theta" else layout.clamps(BAND)
    assert answers(path, lambda: launch_output(params, BAND, theta, DRAW, layout.root)) > 0


def test_what_observe_says_before_and_after(params, layout) -> None:
    path = layout.confidence(BAND, METHOD)
    assert answers(path, lambda: prediction_of(params, BAND, METHOD, DRAW, layout.root)) > 0


def test_an_export_is_replaced_where_its_card_says_so(tmp_path: Path) -> None:
    card = {"target": "mjcf", "files": {"toy.xml": "the chain"}}
    path = tmp_path / "card.json"
    (tmp_path / "mine.txt").touch()
    for what, edited in edits(card):
        path.write_text(json.dumps(edited))
        assert not replaceable(tmp_path), what
