"""Nothing of the rig reaches the identification but the recording, `setup:` and `bands:`."""

from pathlib import Path

import pytest
from mcap.reader import make_reader

from rig.recorder.interaction import Interaction
from sling2sim2real.identification.objective.loss import EpisodeLoss
from sling2sim2real.recording.build import build_episodes
from sling2sim2real.simulator.model import ClampedBand
from tests.project import STAGES

WORLD = {"record", "trials", "floor"}
SHOWN = ("data/trials", "data/floor")  # what came of launches on the rig
JUDGES = {"trials", "report", "card"}


class Hidden:
    def __getattribute__(self, name: str):
        raise AssertionError(f"rig.{name} was read")


def test_an_episode_and_its_loss_are_made_without_the_world(coarse, recorded) -> None:
    """What knows nothing of `rig:` gives the same numbers."""
    blind = coarse.model_copy(update={"rig": Hidden()})
    with pytest.raises(AssertionError, match=r"rig\.seed was read"):
        blind.rig.seed  # noqa: B018
    band = blind.bands["band1"]
    episode = build_episodes(recorded[0], "band1", blind)[0][0]
    sling = ClampedBand.of(band, blind.setup, blind.sling)
    EpisodeLoss.of(blind, "paper", episode, sling)


def test_stages_depend_on_the_world_where_they_may() -> None:
    for name, stage in STAGES.items():
        hidden = [key for key in stage.get("params", []) if key.split(".")[0] == "rig"]
        assert bool(hidden) == (name in WORLD), f"{name}: {hidden}"


def test_no_launch_reaches_what_is_identified() -> None:
    """Landings go to report and cards alone, and a stage reads raw recordings, not the truth."""
    for name, stage in STAGES.items():
        data = [dep for dep in stage["deps"] if dep.startswith("data/")]
        assert name in {"report", "card"} or not any(dep.startswith(SHOWN) for dep in data)
        assert name in JUDGES or not any(dep.startswith("data/policies") for dep in data)
        assert name != "record" or not data


def test_a_recording_holds_no_truth(recorded: tuple[Path, Interaction]) -> None:
    """Topics of a lab (test_record.py) are all of it: nothing is attached, no topic has notes."""
    with open(recorded[0], "rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary.statistics.attachment_count == summary.statistics.metadata_count == 0
    assert not any(channel.metadata for channel in summary.channels.values())
