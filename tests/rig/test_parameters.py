"""Each number under `rig:` changes the recording, and just those topics that it should."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from mcap.reader import make_reader

from pipeline.params import Params
from pipeline.params.virtual_rig import RigFlow, RigSoftening, RigSpectrum
from rig.physics import motion
from rig.physics.launch import launch
from rig.recorder import camera, record
from sling2sim2real.base.schema import Section
from sling2sim2real.settings.lab import Dip
from tests.project import with_

TF, GRIPPER = "/tf_static", "/franka_gripper/joint_states"
POSE, WRENCH = "/franka_robot_state_broadcaster/current_pose", "/ft_sensor/wrench"
COLOR, COLOR_INFO = "/camera/color/image_raw/compressed", "/camera/color/camera_info"
DEPTH, DEPTH_INFO = "/camera/depth/image_raw/compressedDepth", "/camera/depth/camera_info"
PICTURE = {COLOR, DEPTH}
CAMERA = PICTURE | {COLOR_INFO, DEPTH_INFO}
HAND = {POSE, WRENCH}  # what moves the hand; whether a pixel changes too is left open
EVERYTHING = CAMERA | {TF, GRIPPER, POSE, WRENCH}
LANDING = {"landing"}
DIPS = (Dip(at=0.5, depth=0.05, out_time=0.1, back_time=0.1),)

HASTE = {"PULL": 1.2, "PULLED": 2, "OPEN": 2.4, "RETREAT": 2.45, "RETREATED": 2.5, "END": 2.55}
CHANGES = {  # the longest prefix of a number's name counts
    "seed": EVERYTHING | LANDING,
    "edges": HAND | LANDING,
    "tolerance": HAND | LANDING,
    "pads": HAND,
    "tracking_error": HAND,
    "pose_latency": {POSE},
    "release_jitter": LANDING,
    "projectile_drag": LANDING,
    "base": PICTURE | {TF, POSE},
    **{f"base.{i}": {TF, POSE} for i in range(3, 7)},  # turns what is reported, moves nothing
    "tool_pitch": HAND,
    "arm": HAND,
    "arm.stiffness": HAND | LANDING,
    "clock": {GRIPPER, POSE, WRENCH},
    "wrench": {WRENCH},
    "wrench.yaw": {TF, WRENCH},
    "camera.position": PICTURE | {TF},
    "camera.target": PICTURE | {TF},
    "camera.focal": CAMERA,
    "camera.range": {DEPTH},
    "camera.exposure": PICTURE,
    "camera.clock": CAMERA,
    "camera.drop_rate": CAMERA,
    "camera.color_noise": {COLOR},
    "camera.depth_noise": {DEPTH},
    "camera.dropout": {DEPTH},
    "camera.edge_loss": {DEPTH},
    "camera.edge_fly": {DEPTH},
    "camera.translation_error": {TF},
    "camera.rotation_error": {TF},
    "bands.band1": HAND | LANDING,
    "bands.band1.color": {COLOR},
}
RUBBER = {  # all that a band can have
    "law": "extended_tube",
    "constants": (0.0954, 0.331, 1.111),
    "spectrum": RigSpectrum(weight=0.1, times=(0.01, 1.0), branches=2, slope=0.5),
    "flow": RigFlow(share=0.3, rate=200.0, power=4.0, chain=-0.6, offset=0.05),
    "softening": RigSoftening(damage=2.0, energy=0.1, growth=0.1),
}


def numbers(value: Any, name: str = "") -> Iterator[str]:
    """Names of the numbers in `value`."""
    if isinstance(value, Section):
        value = dict(value)
    if isinstance(value, tuple):
        value = {str(i): part for i, part in enumerate(value)}
    if not isinstance(value, dict):
        if isinstance(value, int | float):
            yield name
        return
    for key, part in value.items():
        yield from numbers(part, f"{name}.{key}".lstrip("."))


def changed(value: Any, name: str) -> Any:
    """`value` with another number at `name`, which may be its own."""
    if not name:
        return value + 4 if isinstance(value, int) else value * 1.5 + 0.01 * (value == 0)
    key, _, rest = name.partition(".")
    if isinstance(value, tuple):
        at = int(key)
        return (*value[:at], changed(value[at], rest), *value[at + 1 :])
    if isinstance(value, dict):
        return {**value, key: changed(value[key], rest)}
    return value.model_copy(update={key: changed(getattr(value, key), rest)})


def expected(name: str) -> set[str]:
    fits = [prefix for prefix in CHANGES if f"{name}.".startswith(f"{prefix}.")]
    assert fits, f"rig.{name}: say here what it changes"
    return CHANGES[max(fits, key=len)]


class Laboratory:
    """Recordings of a rough band, quickly pulled, by a small camera: messages by topic."""

    def __init__(self, path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.path, self.done = path, {}
        self.pull_and_release, self.hang = record.pull_and_release, record.hang
        monkeypatch.setattr(record, "SENSOR_RATE", 100)
        monkeypatch.setattr(record, "PIXELS_APART", 0.1)
        monkeypatch.setattr(camera, "RATE", 5.0)
        for name, value in HASTE.items():
            monkeypatch.setattr(motion, name, value)
        monkeypatch.setattr(record, "pull_and_release", self.remembered)
        monkeypatch.setattr(record, "hang", self.hanging)

    def hanging(self, string, tolerance):
        """The same array for the same band."""
        key = id(string), tolerance
        if key not in self.done:
            self.done[key] = self.hang(string, tolerance)
        return self.done[key]

    def remembered(self, string, hanging, motion, sensor_times, camera_times, params, progress):
        """Integrate anew only where something that goes in is new."""
        world = {name: getattr(params.rig, name) for name in ("pads", "arm", "tolerance")}
        path = motion.path
        arrays = hanging, path.times, path.amplitude, path.frequency, path.phase, camera_times
        key = id(string), repr(world), *(array.tobytes() for array in arrays)
        if key not in self.done:
            seen = SimpleNamespace(rig=SimpleNamespace(**world), setup=params.setup)
            arguments = string, hanging, motion, sensor_times, camera_times, seen
            done = self.pull_and_release(*arguments)
            rounded = {name: getattr(done, name).round(9) for name in ("force", "acceleration")}
            self.done[key] = replace(done, **rounded)  # the last bits depend on the frames
        return self.done[key]

    def __call__(self, params: Params) -> dict[str, Any]:
        record.record(params, "band1", self.path, picture_scale=0.1)
        topics: dict[str, Any] = {}
        with open(self.path, "rb") as stream:
            for _, channel, message in make_reader(stream).iter_messages():
                content = message.data, message.log_time, message.publish_time
                topics.setdefault(channel.topic, []).append(content)
        return topics


def rough(params: Params) -> Params:
    """Few frames and few pixels, so that chance has its way; of draws: test_draw.py."""
    bands = {"band1": params.rig.bands["band1"].model_copy(update=RUBBER)}
    eyes = {"drop_rate": 0.3, "dropout": 0.01}
    camera = params.rig.camera.model_copy(update=eyes)
    values = {"edges": 8, "tolerance": 1e-2, "draws": {}, "launch_draws": {}}
    return with_(params, "rig", camera=camera, bands=bands, **values)


@pytest.mark.slow
def test_a_pull_with_dips_is_longer_and_another(params, tmp_path, monkeypatch) -> None:
    """What is not pulled so does not depend on the dips."""
    world = with_(rough(params), "plan", dips=DIPS)
    laboratory = Laboratory(tmp_path / "band1.mcap", monkeypatch)
    plain = laboratory(world)
    recordings = {"plain": world.rig.recordings["plain"].model_copy(update={"pull": "informative"})}
    dipped = laboratory(with_(world, "rig", recordings=recordings))
    assert {topic for topic in plain if plain[topic] != dipped[topic]} == EVERYTHING
    assert len(dipped[WRENCH]) == len(plain[WRENCH]) + 20  # 0.2 s
    assert laboratory(with_(world, "plan", dips=())) == plain


@pytest.mark.slow
def test_each_number_changes_what_it_should(params, tmp_path, monkeypatch) -> None:
    rig = rough(params).rig
    laboratory = Laboratory(tmp_path / "band1.mcap", monkeypatch)

    def everything(rig: Section, fly: bool) -> dict[str, Any]:
        world = params.model_copy(update={"rig": rig})
        landing = {"landing": launch("band1", world, (-0.30, -0.15), 0)} if fly else {}
        return laboratory(world) | landing

    before = everything(rig, True)
    assert set(before) == EVERYTHING | LANDING
    wrong = {}
    for name in numbers(rig):
        now = everything(changed(rig, name), "landing" in expected(name))
        topics = {topic for topic in now if now[topic] != before[topic]}
        if HAND <= expected(name) and TF not in expected(name):
            topics -= PICTURE
        if topics != expected(name):
            wrong[name] = topics ^ expected(name)
    assert not wrong, "changed, or should have"
