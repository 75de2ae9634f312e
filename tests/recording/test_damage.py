"""A damaged file: the same episode up to the damage, which is said, or one line; never silence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.build import build_episodes
from sling2sim2real.recording.streams import read_recording
from tests import once
from tests.recording.test_foxglove import assert_same_episode
from validation.recordings.small import CONTAINERS, FAMILIES, small_params, write_small

PARAMS = small_params()


@pytest.fixture(scope="session")
def small(tmp_path_factory) -> Path:
    """A folder of small recordings, one of each family in each container; to be read only."""

    def make(folder: Path) -> None:
        for family in FAMILIES:
            for container in CONTAINERS:
                write_small(folder / f"{family}-{container}.mcap", family, container)

    return once.folder(tmp_path_factory, "small", make)


def damaged(content: bytes, kind: str, place: float, value: int) -> bytes:
    """A file that was cut, in which a byte is another one, or in which a kilobyte is zero."""
    at = int(place * len(content))
    if kind == "cut":
        return content[:at]
    if kind == "byte":
        return content[:at] + bytes([content[at] ^ value]) + content[at + 1 :]
    return content[:at] + bytes(1000) + content[at + 1000 :]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    family=st.sampled_from(sorted(FAMILIES)),
    container=st.sampled_from(sorted(CONTAINERS)),
    kind=st.sampled_from(["cut", "byte", "zeros"]),
    place=st.floats(0.001, 0.999),
    value=st.integers(1, 255),
)
def test_damage_is_read_around_and_said(
    small, tmp_path, family, container, kind, place, value
) -> None:
    whole, path = small / f"{family}-{container}.mcap", tmp_path / "damaged.mcap"
    path.write_bytes(damaged(whole.read_bytes(), kind, place, value))
    try:
        recording = read_recording(path, PARAMS.setup)
        episode = build_episodes(path, "band1", PARAMS)[0][0]
    except UserError as error:
        assert str(path) in str(error) and str(error).isprintable()
        return
    sound = read_recording(whole, PARAMS.setup)
    if not recording.losses:
        assert_same_episode(episode, build_episodes(whole, "band1", PARAMS)[0][0])
    elif container != "unchunked":  # of which only one checksum tells, and not what is damaged
        for role, stream in recording.streams.items():
            places = np.searchsorted(sound.streams[role].stamp, stream.stamp)
            np.testing.assert_array_equal(sound.streams[role].stamp[places], stream.stamp)
            if role not in ("color", "depth"):
                values = sound.streams[role].values[places]
                np.testing.assert_array_equal(values, stream.values)
