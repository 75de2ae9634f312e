"""The measured calibration against clouds and recordings that are misplaced by known amounts."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.spatial.transform import Rotation

from sling2sim2real.recording.build import process
from sling2sim2real.recording.checks.camera import camera_to_fork
from sling2sim2real.recording.tips import measure_tips
from sling2sim2real.recording.view import Scene
from tests.project import with_
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


def offsets(shift=(0, 0, 0), turn=(0, 0, 0)) -> np.ndarray:
    """Where a camera that is misplaced so shows the tips, less where they are."""
    return Rotation.from_rotvec(turn).apply(TIPS) + shift - TIPS


@pytest.mark.parametrize(
    ("shift", "turn"),
    [
        ((0, 0, 0), (0, 0, 0)),
        ((0.008, 0, 0), (0, 0, 0)),
        ((0, -0.006, 0.005), (0, 0, 0)),
        ((0, 0, 0), (0.005, -0.009, 0.007)),
        ((0.003, 0.004, -0.007), (-0.004, 0.006, 0.005)),
    ],
)
def test_a_misplaced_camera_is_measured(shift, turn) -> None:
    tips = measure_tips(*drawn(shift, turn), EYE, DOWN)
    truth = offsets(shift, turn)
    np.testing.assert_allclose(tips.offsets, truth, atol=0.0015)
    assert np.all(np.abs(tips.offsets - truth) < 3 * tips.errors)
    # The correction puts the tips, as they are shown, where they are.
    np.testing.assert_allclose(tips.correction.apply(TIPS + truth), TIPS, atol=0.0015)
    assert np.linalg.norm(tips.hand) < 3 * np.linalg.norm(tips.hand_error)
    assert tips.residual < NOISE


def test_a_misplaced_hand_is_no_misplaced_camera() -> None:
    tips = measure_tips(*drawn(hand_shift=(0.008, 0, 0)), EYE, DOWN)
    assert tips.hand[0] == pytest.approx(-0.008, abs=0.003)
    assert np.all(np.abs(tips.hand + [0.008, 0, 0]) < 3 * tips.hand_error)
    np.testing.assert_allclose(tips.offsets, 0, atol=0.0015)


def test_the_seen_side_is_not_taken_for_the_middle() -> None:
    """A camera on the other side of the band moves the seen side by millimetres."""
    for eye in (EYE, np.array([-0.75, 0.28, 0.42])):
        tips = measure_tips(*drawn(eye=eye), eye, DOWN)
        assert np.abs(tips.offsets[:, 0]).max() < 0.0015


@pytest.mark.parametrize("stiffness", [0.008, 0.020])
def test_a_band_that_bends_out_of_its_clamps(stiffness) -> None:
    """Its line passes up to 2 cm below the tip; that is no misplaced camera."""
    shift = (0.0, 0.004, 0.003)
    tips = measure_tips(*drawn(shift, stiffness=stiffness), EYE, DOWN)
    np.testing.assert_allclose(tips.offsets, offsets(shift), atol=0.003)
    assert np.all(np.abs(tips.offsets - offsets(shift)) < 3 * tips.errors)


def test_too_little_of_the_drawn_band_says_nothing() -> None:
    scene, times, clouds = drawn()
    assert measure_tips(scene, times[:3], clouds[:3], EYE, DOWN) is None
    empty = [np.zeros((0, 3), np.float32)] * len(times)
    assert measure_tips(scene, times, empty, EYE, DOWN) is None

    # A hand that is sixteen times faster.
    slow, fast = scene.signals, SimpleNamespace(**vars(scene.signals))
    fast.time, fast.hand = slow.time / 16, lambda time: slow.hand(16 * time)
    assert measure_tips(replace(scene, signals=fast), times / 16, clouds, EYE, DOWN) is None


def misplaced(shift: np.ndarray, turn: np.ndarray):
    """/tf_static as a calibration that is wrong by so much, frame O, writes it."""
    wrong = Rotation.from_rotvec(turn)

    def move(stamp: int, message) -> None:
        for transform in message.transforms:
            if transform.child_frame_id == "optical":
                p, q = transform.transform.translation, transform.transform.rotation
                place = wrong.apply(BASE[0].apply([p.x, p.y, p.z]) + BASE[1]) + shift
                p.x, p.y, p.z = map(float, BASE[0].inv().apply(place - BASE[1]))
                turned = wrong * BASE[0] * Rotation.from_quat([q.x, q.y, q.z, q.w])
                q.x, q.y, q.z, q.w = map(float, (BASE[0].inv() * turned).as_quat())

    return edit(tf=move)


def test_a_misplaced_tf_static_is_measured(checked, params, tmp_path) -> None:
    """The renderer's own bias is in both recordings; each is within its errors, too."""
    shift, turn = (0.002, -0.005, 0.004), (0.0, 0.005, 0.0052)
    path = tmp_path / "misplaced.mcap"
    write_bag(path, rate=500, change=misplaced(np.array(shift), np.array(turn)))
    done, truth = process(path, params.bands["band1"], params), offsets(shift, turn)
    measured = done.tips.offsets
    np.testing.assert_allclose(measured - checked.tips.offsets, truth, atol=0.0007)
    assert np.all(np.abs(measured - truth) < 3 * done.tips.errors)
    assert [caution for caution in done.cautions if caution.about == "extrinsics"]
    assert not [caution for caution in checked.cautions if caution.about == "extrinsics"]

    # What is proposed for params.yaml brings the clouds back.
    pose = tuple(camera_to_fork(done.tips, done.pull.geometry))
    placed = with_(params, "setup", camera_to_fork=pose)
    again = process(path, params.bands["band1"], placed)
    assert np.abs(again.tips.offsets).max() < 0.0007


@pytest.mark.parametrize("factor", [0.97, 1.01, 1.03])
def test_a_scale_of_depth_is_told_from_a_misplaced_camera(factor) -> None:
    scene, times, clouds = drawn()
    seen = [EYE + factor * (cloud - EYE) for cloud in clouds]
    tips = measure_tips(scene, times, seen, EYE, DOWN)
    assert tips.is_off and tips.lens.kind == "depth"
    assert tips.lens.factor == pytest.approx(factor, abs=3 * tips.lens.error)
    across = np.cross(EYE, [0.0, 0.0, 1.0])
    moved = [cloud + 0.012 * across / np.linalg.norm(across) for cloud in clouds]
    tips = measure_tips(scene, times, moved, EYE, DOWN)
    assert tips.is_off and tips.lens is None
