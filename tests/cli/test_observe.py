"""`sling observe`: a launch is written down once, learned from, and the card made again."""

import numpy as np
import pytest

from sling2sim2real import Identification, UserError
from sling2sim2real.api.band_folder import BandFolder
from sling2sim2real.base.launches_file import LaunchRow, read_launches, write_launches
from sling2sim2real.cli.observe import observe, shown
from tests.cli.test_fit import TOY, no_recording_is_read

__all__ = ["no_recording_is_read"]
DRAW = (-0.30, -0.15)


def row(landing: float | None, **more) -> LaunchRow:
    return LaunchRow(DRAW, more.pop("error", None), landing, **more)


def test_a_launch_moves_the_prediction_and_the_card(copied, no_recording_is_read) -> None:
    """It lands where the middle of the interval is, so nothing is doubted."""
    card = (TOY / "card/README.md").read_text()
    first = observe(BandFolder(TOY), row(1.9))
    assert first["launches"] == 1 and first["measured_m"] == 1.9
    widths = [max(answer) - min(answer) for answer in (
        first["before"]["interval_90_m"], first["after"]["interval_90_m"])]  # fmt: skip
    assert widths[1] < 0.5 * widths[0]
    low, high = first["after"]["interval_90_m"]
    assert low < 1.9 < high
    assert read_launches(TOY / "launches.csv") == [row(1.9)]
    assert not Identification.load(TOY).stale
    assert (TOY / "card/README.md").read_text() != card
    text = shown(first)
    assert "1 launch\n" in text and "before" in text and text.endswith("measured  1.900 m")

    with pytest.raises(UserError, match="this launch is there already; if you measured one more"):
        observe(BandFolder(TOY), row(1.9))
    again = observe(BandFolder(TOY), row(1.9), again=True)
    assert again["launches"] == 2
    held = observe(BandFolder(TOY), row(1.0, use="check"))
    assert held["after"] == again["after"] and held["use"] == "check"
    (doubt,) = held["warnings"]
    assert doubt["about"] == "miss" and "lies outside the predicted interval" in doubt["what"]


def test_a_speed_is_evidence_beside_the_landing_or_alone(copied, no_recording_is_read) -> None:
    """Half the energy that was predicted: the share that launches return falls."""
    fast = row(None, error=0.001, speed=3.3, angle=40.0)
    done = observe(BandFolder(TOY), fast)
    before, after = done["before"], done["after"]
    assert after["speed"] < before["speed"]
    assert after["returned_share"] < before["returned_share"]
    (entry,) = Identification.load(TOY).confidence["launches"]
    assert entry["measured"] == {"speed": 3.3, "angle": pytest.approx(np.deg2rad(40.0))}
    assert abs(entry["left"]["speed"]) < 0.02 and entry["z_without_it"]["speed"] < 0
    assert shown(done).endswith("measured  3.30 m/s, 40.0 degrees")
    assert read_launches(TOY / "launches.csv") == [fast]


def test_a_retry_goes_on(copied, monkeypatch) -> None:
    """Killed while it fitted, the launch is there, and is not there twice."""
    write_launches(TOY / "launches.csv", [row(1.9)])
    assert Identification.load(TOY).stale
    done = observe(BandFolder(TOY), row(1.9))
    assert done["launches"] == 1 and not Identification.load(TOY).stale


def test_what_no_launch_can_be_is_refused_and_a_further_draw_doubted(copied, monkeypatch) -> None:
    monkeypatch.setattr("sling2sim2real.cli.observe.fit", lambda folder: None)
    for draw, words in (((-0.3, -0.6), "lies below the floor"),):
        with pytest.raises(UserError, match=words):
            observe(BandFolder(TOY), LaunchRow(draw, None, 1.9))
    assert not (TOY / "launches.csv").exists()
    far = observe(BandFolder(TOY), LaunchRow((-0.5, -0.1), 0.001, 3.0))
    assert "stretch" in {warning["about"] for warning in far["warnings"]}
    assert any("softens up to its largest" in warning["what"] for warning in far["warnings"])
