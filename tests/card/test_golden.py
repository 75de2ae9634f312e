"""What a card says and what card.json holds, of exact launches, as committed in golden/."""

import json
from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sling2sim2real.card.conclusion import Conclusion
from sling2sim2real.card.inputs import Aims, CardInputs
from sling2sim2real.card.text import card_text
from sling2sim2real.card.write import content
from sling2sim2real.launching.trials.spread import Spread
from tests.golden import expect_golden

GOLDEN = Path(__file__).parent / "golden"
LANDINGS = np.array([1.726, 1.924, 2.123])
INTERVAL = LANDINGS[:, None] + [-0.112, 0.123]
AIMS = Aims(
    target=np.array([1.725, 1.925, 2.125]),
    draw=np.array([[-0.31, -0.17], [-0.33, -0.18], [-0.35, -0.19]]),
    landing=LANDINGS,
    interval=INTERVAL,
    hold_force=np.array([8.123, 8.678, 9.234]),
    failure=[None, None, None],
    stretch=np.array([1.4, 1.45, 1.5]),
    spread=Spread(
        chosen=np.arange(40),
        centres=LANDINGS[:, None] + np.linspace(-0.1, 0.1, 40),
        slope=np.array([0.03, 0.031, 0.032]),
        interval=INTERVAL,
    ),
)


@pytest.fixture
def inputs(summary) -> CardInputs:
    """A band of the rig with a caution, a value that the recording does not tell, and evidence."""
    caution = {"about": "gap", "what": "the pose has a gap of 0.1 s", "cure": "record it again"}
    metadata = summary.episode.metadata | {"cautions": [caution]}
    known = deepcopy(summary.confidence)
    known["parameters"]["mooney_share"] |= {"prior": [-0.24, 0.84], "identifiable": False}
    told = {
        "measured": {"landing": 1.9},
        "left": {"landing": 0.01},
        "z_without_it": {"landing": 0.5},
    }
    known["launches"] = [{"draw": [-0.3, -0.2], **told}]
    return replace(
        summary,
        found=replace(summary.found, confidence=known),
        episodes=[replace(summary.episode, metadata=metadata)],
        aims=AIMS,
        virtual=True,
    )


def concluded(inputs: CardInputs) -> Conclusion:
    return Conclusion.of(inputs, np.zeros_like(inputs.episode.force))


def test_what_a_card_says(inputs) -> None:
    expect_golden(card_text(inputs, concluded(inputs)), GOLDEN / "README.md")
    card = json.dumps(content(inputs, concluded(inputs)), indent=1, ensure_ascii=False)
    expect_golden(f"{card}\n", GOLDEN / "card.json")


def test_a_launch_that_fails_has_no_landing(inputs) -> None:
    lost = replace(
        AIMS,
        landing=np.append(LANDINGS[:2], np.nan),
        interval=np.append(AIMS.interval[:2], [[np.nan, np.nan]], axis=0),
        failure=[None, None, "the simulation did not converge"],
    )
    failed = replace(inputs, aims=lost)
    text = card_text(failed, concluded(failed))
    assert "| 2.125 m | -0.3500, -0.1900 m | the simulation did not converge |" in text
    last = content(failed, concluded(failed))["draws"][2]
    assert last["predicted_landing_m"] is None and last["interval_90_m"] is None


def test_without_a_density_it_tells_less(inputs) -> None:
    plain = replace(inputs, found=replace(inputs.found, confidence={}, samples=None))
    card = content(plain, concluded(plain))
    assert card["verdict"] != "can be trusted"
    assert any("no uncertainty" in reason for reason in card["reasons"])
    assert all(value["low"] is None for value in card["values"])
    assert "This method gives no such differences" in card_text(plain, concluded(plain))
