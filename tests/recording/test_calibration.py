"""The measured calibration against clouds and recordings that are misplaced by known amounts."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.spatial.transform import Rotation

from sling2sim2real.recording.calibration import calibration_of
from sling2sim2real.recording.checks import camera_to_fork
from sling2sim2real.recording.scene import Scene
from tests.project import with_
from tests.recording.conftest import processed_of, whole_of
from validation.recordings.bag import BASE, EYE, TIPS, edit, write_bag

DIAMETER, REST = 0.010, 0.52
DOWN = np.array([0.0, 0.0, -1.0])
NOISE = 0.0008  # m


def drawn(shift=(0, 0, 0), turn=(0, 0, 0), hand_shift=(0, 0, 0), stiffness=None, eye=EYE):
    """A band drawn by 0.26 to 0.4 m: the sides of its two halves that a camera sees.

    The clouds are shifted and turned as a misplaced camera does it, and so is what the robot says
    of its hand.

    Args:
        eye: Where the camera is.
        stiffness: sqrt(EI) [sqrt(N) m] of a band that bends out of its clamps, under the tension of
            a real one; None for one so tight that it is straight.
    """
    random = np.random.default_rng(3)
    times = np.arange(40) / 10
    hands = np.stack([0 * times, -np.linspace(0.26, 0.4, 40), -0.02 * times], axis=1)
    clouds, forces = [], []
    for hand in hands:
        points, force = [], np.zeros(3)
        stretch = np.linalg.norm(TIPS - hand, axis=1).sum() / REST
        tension = 12.0 * (stretch - 1) if stiffness else 1e5
        for tip in TIPS:
            force -= tension * (hand - tip) / np.linalg.norm(hand - tip)
            line = np.linspace(tip, hand, 2000)
            if stiffness:
                line = bent(tip, hand, stiffness / np.sqrt(tension))
            way = np.gradient(line, axis=0)
            far = np.linalg.norm(line - hand, axis=1) > 0.03
            chosen = random.choice(np.flatnonzero(far), 300)
            line, way = line[chosen], way[chosen]
            way /= np.linalg.norm(way, axis=1)[:, None]
            side = np.cross(way, [0.0, 0.3, 1.0])
            side /= np.linalg.norm(side, axis=1)[:, None]
            angle = random.uniform(0, 2 * np.pi, 300)[:, None]
            normal = np.cos(angle) * side + np.sin(angle) * np.cross(way, side)
            surface = line + DIAMETER / 2 / np.sqrt(stretch) * normal
            visible = np.einsum("pi,pi->p", normal, eye - line) > 0
            points.append(surface[visible])
        cloud = np.concatenate(points) + random.normal(0, NOISE, (sum(map(len, points)), 3))
        clouds.append(Rotation.from_rotvec(turn).apply(cloud) + shift)
        forces.append(force)
    stated = hands + hand_shift

    def at(time):
        return np.stack([np.interp(time, times, axis) for axis in stated.T], axis=-1)

    signals = SimpleNamespace(
        time=times, force=np.array(forces), hand=at, grasp_time=-1.0, release_time=9.0
    )
    return Scene(TIPS, -0.52, DIAMETER, REST, signals), times, clouds


def bent(tip: np.ndarray, hand: np.ndarray, scale: float) -> np.ndarray:
    """An elastica clamped downwards in the tip and along the fork in the hand, (2000, 3).

    Its angle to its own straight middle is 4 atan(tan(phi / 4) exp(-s / l)), l = sqrt(EI / T).
    """
    s = np.linspace(0, 0.1, 2000)
    ends = [np.zeros(3), np.zeros(3)]
    clamps = (DOWN, np.array([np.sign(tip[0]), 0, 0]))
    for _ in range(20):
        way = (hand + ends[1]) - (tip + ends[0])
        way /= np.linalg.norm(way)
        for i, (clamp, along) in enumerate(zip(clamps, (way, -way), strict=True)):
            aside = clamp - (clamp @ along) * along
            aside /= np.linalg.norm(aside)
            phi = np.arccos(clamp @ along)
            theta = 4 * np.arctan(np.tan(phi / 4) * np.exp(-s / scale))
            curve = trapezoid(np.sin(theta), s)
            ends[i] = curve * aside
    rest = np.linspace(0, 1, 1000)[:, None]
    phi = np.arccos(DOWN @ way)
    theta = 4 * np.arctan(np.tan(phi / 4) * np.exp(-s / scale))
    aside = (DOWN - (DOWN @ way) * way) / np.linalg.norm(DOWN - (DOWN @ way) * way)
    steps = np.stack([np.cos(theta), np.sin(theta)], axis=1) * (s[1] - s[0])
    first = tip + np.cumsum(steps, axis=0) @ np.stack([way, aside])
    last = first[-1] + rest * ((hand + ends[1] - first[-1]) @ way) * way
    return np.vstack([first[::2], last])


LIGHT = 1e-6  # kg: the bands of `drawn` do not sag


@pytest.mark.parametrize(
    "shift", [(0, 0, 0), (0.008, 0, 0), (0, -0.012, 0.005), (0.003, 0.004, -0.007)]
)
def test_a_misplaced_camera_is_measured(shift) -> None:
    seen = calibration_of(*drawn(shift), EYE, LIGHT, DOWN)
    assert np.all(np.abs(seen.camera - shift) < 3 * seen.camera_error)
    np.testing.assert_allclose(seen.camera[[0, 2]], np.array(shift)[[0, 2]], atol=0.0025)
    assert np.linalg.norm(seen.hand) < 3 * np.linalg.norm(seen.hand_error)
    assert seen.residual < 2 * NOISE  # the band is round
    assert seen.is_off == (np.linalg.norm(shift) > 0.008 or shift[0] > 0.005)


def test_a_misplaced_hand_is_no_misplaced_camera() -> None:
    seen = calibration_of(*drawn(hand_shift=(0.008, 0, 0)), EYE, LIGHT, DOWN)
    assert seen.hand[0] == pytest.approx(-0.008, abs=0.003)
    assert np.all(np.abs(seen.hand + [0.008, 0, 0]) < 3 * seen.hand_error)
    assert not seen.is_off


def test_the_seen_side_is_not_taken_for_the_middle() -> None:
    """A camera on the other side of the band moves the seen side by millimetres."""
    for eye in (EYE, np.array([-0.75, 0.28, 0.42])):
        seen = calibration_of(*drawn(eye=eye), eye, LIGHT, DOWN)
        assert abs(seen.camera[0]) < 0.0015


@pytest.mark.parametrize("stiffness", [0.008, 0.020])
def test_a_band_that_bends_out_of_its_clamps(stiffness) -> None:
    """Its line passes up to 2 cm below the tip; that is no misplaced camera."""
    shift = np.array([0.0, 0.004, 0.003])
    seen = calibration_of(*drawn(shift, stiffness=stiffness), EYE, LIGHT, DOWN)
    assert np.all(np.abs(seen.camera - shift) < 3 * seen.camera_error)
    assert abs(seen.camera[2] - shift[2]) < 0.005


@pytest.mark.parametrize("turn", [(0, 0.02, 0), (0, 0, 0.03)])
@pytest.mark.parametrize("factor", [0.97, 1.0, 1.03])
def test_a_turned_camera_and_a_scale_of_depth_are_noticed(turn, factor) -> None:
    """They move what is seen, whatever the fit calls it."""
    scene, times, clouds = drawn()
    about = Rotation.from_rotvec(turn)
    clouds = [EYE + factor * about.apply(cloud - EYE) for cloud in clouds]
    assert calibration_of(scene, times, clouds, EYE, LIGHT, DOWN).is_off


def test_too_little_of_the_drawn_band_says_nothing() -> None:
    scene, times, clouds = drawn()
    rest = EYE, LIGHT, DOWN
    assert calibration_of(scene, times[:3], clouds[:3], *rest) is None
    empty = [np.zeros((0, 3), np.float32)] * len(times)
    assert calibration_of(scene, times, empty, *rest) is None

    # A hand that is sixteen times faster.
    slow, fast = scene.signals, SimpleNamespace(**vars(scene.signals))
    fast.time, fast.hand = slow.time / 16, lambda time: slow.hand(16 * time)
    assert calibration_of(replace(scene, signals=fast), times / 16, clouds, *rest) is None


def misplaced(shift: np.ndarray):
    """/tf_static as a calibration that is wrong by so much, frame O, writes it."""

    def move(stamp: int, message) -> None:
        for transform in message.transforms:
            if transform.child_frame_id == "optical":
                p = transform.transform.translation
                p.x, p.y, p.z = map(float, [p.x, p.y, p.z] + BASE[0].inv().apply(shift))

    return edit(tf=move)


def test_a_misplaced_tf_static_is_measured(checked, processed, params, tmp_path) -> None:
    """The renderer's own bias is in both recordings."""
    shift = np.array([0.004, -0.007, 0.005])
    path = tmp_path / "misplaced.mcap"
    write_bag(path, rate=500, change=misplaced(shift))
    done = processed_of(path, params)
    seen = done.whole.calibration
    np.testing.assert_allclose(seen.camera - checked.calibration.camera, shift, atol=0.0015)
    assert [caution for caution in done.cautions if caution.about == "extrinsics"]
    assert not [caution for caution in processed.cautions if caution.about == "extrinsics"]

    # What is proposed for params.yaml brings the clouds back.
    pose = tuple(camera_to_fork(seen, done.part.geometry))
    again = whole_of(path, with_(params, "setup", camera_to_fork=pose))
    assert np.abs(again.calibration.camera).max() < 0.0015
