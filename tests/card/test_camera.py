"""Where points of frame O are seen: against the truth of a recording, and OpenCV with a lens."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.layout import Layout
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import NotMade
from sling2sim2real.card.camera import Pictures
from sling2sim2real.card.simulated import simulate
from sling2sim2real.recording.frames import EpisodeGeometry, geometry_of
from sling2sim2real.recording.streams import read_recording
from sling2sim2real.recording.transforms import Transform
from tests.card.conftest import BAND, PAIR, TRUTH
from tests.recording.parts import split


@pytest.fixture(scope="module")
def pictures(summary, project) -> Pictures:
    return Pictures.of(
        Layout(project).raw(PAIR) / "seen.mcap", summary.episode, summary.params.setup
    )


def band_coloured(image: np.ndarray, places: np.ndarray) -> float:
    """Share of places (N, 2) at which an image has the band's orange."""
    whole = np.round(places).astype(int)
    seen = image[whole[:, 1], whole[:, 0]].astype(int)
    return float(np.mean(seen[:, 2] - seen[:, 0] > 60))


def test_the_recorded_band_is_seen_where_it_is_projected(pictures, summary) -> None:
    drawn = np.flatnonzero((pictures.time > TRUTH.drawn) & (pictures.time < TRUTH.release - 0.02))
    assert len(drawn) > 3
    for number in drawn:
        line = TRUTH.center_line(float(pictures.time[number]))
        line = line[np.linalg.norm(line - TRUTH.hand(TRUTH.drawn), axis=1) > 0.08]  # of the fingers
        line = line[np.abs(line[:, 1]) > 0.02]  # of the posts
        places = pictures.project(line)
        assert band_coloured(pictures[number], places) > 0.97
        assert band_coloured(pictures[number], places + [0, 4]) < 0.1


def test_the_parts_of_a_split_bag_are_one_recording(pictures, summary, project, tmp_path) -> None:
    split(Layout(project).raw(PAIR) / "seen.mcap", tmp_path / "seen", cuts=(1.5,))
    parts = Pictures.of(tmp_path / "seen", summary.episode, summary.params.setup)
    np.testing.assert_array_equal(parts.time, pictures.time)
    for number in (0, len(parts.time) - 1):
        np.testing.assert_array_equal(parts[number], pictures[number])


def test_what_a_card_shows_is_kept_as_it_is(pictures, summary, tmp_path) -> None:
    """And what is looked up by time is found alike."""
    few = pictures.around(summary.episode)
    few.save(tmp_path / "pictures")
    again = Pictures.load(tmp_path / "pictures", summary.episode)
    assert len(again.time) < len(pictures.time)
    moments = np.append(TRUTH.release + np.arange(-0.25, 0.35, 0.01), TRUTH.grasp - 0.1)
    for moment in moments:
        before, after = (seen.latest(moment) for seen in (pictures, again))
        assert pictures.time[before] == again.time[after]
        np.testing.assert_array_equal(pictures[before], again[after])
    assert again.camera.width == pictures.camera.width


def test_a_missing_recording_is_named(summary, tmp_path) -> None:
    with pytest.raises(NotMade, match="none.mcap"):
        Pictures.of(tmp_path / "none.mcap", summary.episode, summary.params.setup)


def test_a_simulated_pull_holds_the_hand_and_its_states_are_smooth(summary) -> None:
    simulated = simulate(summary.found, summary.episode)
    assert simulated.release == TRUTH.release
    middle = simulated.line(TRUTH.release - 0.05)[60]
    np.testing.assert_allclose(middle, TRUTH.hand(TRUTH.release - 0.05), atol=5e-3)
    fine = np.abs(simulated.time - TRUTH.release - 0.05) < 0.04
    assert np.diff(simulated.time[fine]).max() < 1.1e-3
    between = simulated.line(float(simulated.time[fine][:2].mean()))
    ends = [simulated.line(float(time)) for time in simulated.time[fine][:2]]
    np.testing.assert_allclose(between, np.mean(ends, axis=0), atol=3e-4)
    assert simulated.force.shape == summary.episode.force.shape
    assert simulated.force[(summary.episode.time > 2.5) & (summary.episode.time < 2.9), 1].min() > 3


def test_a_colour_camera_beside_the_depth_camera(summary, project) -> None:
    """What lies before the depth camera is seen where the colour camera's own frame has it."""
    path, setup = Layout(project).raw(PAIR) / "seen.mcap", summary.params.setup
    recording = read_recording(path, setup)
    geometry = geometry_of(recording, setup)
    beside = Transform(Rotation.from_rotvec([0.02, -0.05, 0.01]), np.array([0.06, 0.01, -0.02]))
    retained = EpisodeGeometry.of(recording, replace(geometry, color=beside)).content()
    metadata = summary.episode.metadata | {"geometry": json.loads(json.dumps(retained))}
    pictures = Pictures.of(path, replace(summary.episode, metadata=metadata), setup)
    before = np.array([[0.1, -0.05, 0.9], [-0.2, 0.1, 1.3]])  # the depth camera
    fork = geometry.camera.apply(before)
    expected = pictures.camera.project(beside.apply(before))
    np.testing.assert_allclose(pictures.project(fork), expected, atol=1e-6)


def test_an_episode_of_an_older_version_is_named_with_its_remedy(summary, project) -> None:
    path = Layout(project).raw(PAIR) / "seen.mcap"
    old = {key: value for key, value in summary.episode.metadata.items() if key != "geometry"}
    with pytest.raises(UserError, match=f"of {BAND} are of an older version.*dvc repro"):
        Pictures.of(path, replace(summary.episode, metadata=old), summary.params.setup)
