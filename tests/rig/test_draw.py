"""What a recording draws for itself, and that the identification assumes none of it."""

from __future__ import annotations

from dataclasses import asdict

from pipeline.params import Params
from rig.physics.draw import sampled
from sling2sim2real.identification.posterior.likelihood import Tolerances
from sling2sim2real.settings.identification import POSTERIOR
from tests.project import with_


def value_of(params: Params, key: str) -> float:
    value: object = params.rig
    for name in key.split("."):
        value = getattr(value, name)
    assert isinstance(value, float)
    return value


def test_each_recording_has_its_own_within_the_ranges(params: Params) -> None:
    worlds = [sampled(params, "band1"), sampled(params, "band2")]
    worlds.append(sampled(with_(params, "rig", seed=params.rig.seed + 1), "band1"))
    for key, (low, high) in params.rig.draws.items():
        values = [value_of(world, key) for world in worlds]
        assert len({*values}) == 3, key
        assert all(low <= value <= high for value in values), key
    again = sampled(params, "band1")
    assert all(value_of(again, key) == value_of(worlds[0], key) for key in params.rig.draws)


def test_another_recording_of_a_band_has_other_numbers(params: Params) -> None:
    """By its key; launches are of the rubber."""
    worlds = [sampled(params, key) for key in ("band1", "band1-dips")]
    assert len({value_of(world, "pads.force") for world in worlds}) == 2


def test_launches_and_recordings_share_no_draw(params: Params) -> None:
    recording, launching = sampled(params, "band1"), sampled(params, "band1", launching=True)
    assert not params.rig.draws.keys() & params.rig.launch_draws.keys()
    for key in (*params.rig.draws, *params.rig.launch_draws):
        of_launches = key in params.rig.launch_draws
        assert (value_of(recording, key) != value_of(params, key)) != of_launches
        assert (value_of(launching, key) != value_of(params, key)) == of_launches


ASSUMED = {  # of the identification and the lab, and the rig's number that it stands for
    "dynamic_friction": "pads.friction",
    "shift": "camera.translation_error",
    "turn": "camera.rotation_error",
    "jitter": "camera.clock.stamp_jitter",
    "grip_force": "pads.force",
    "finger_opening_time": "pads.opening_time",
}


def test_no_assumption_of_the_identification_is_the_rigs_number(params: Params) -> None:
    assumed = asdict(Tolerances()) | params.methods[POSTERIOR].fixed | dict(params.setup)
    for name, key in ASSUMED.items():
        hidden = value_of(params, key), value_of(sampled(params, "band1"), key)
        assert assumed[name] not in (*hidden, *params.rig.draws[key]), name
