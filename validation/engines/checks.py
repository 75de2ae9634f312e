"""Our simulator against MuJoCo's 3D flex: the same band, pulled and launched."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sling2sim2real.episode.episode import Episode
from sling2sim2real.simulator.interaction import interact
from sling2sim2real.simulator.launch import launch
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.rubber import NEO_HOOKEAN
from validation.engines import mujoco_flex
from validation.simulator.experiment import band_of, setup_of
from validation.simulator.finding import Bench, Measure, Theme
from validation.synthetic import ease, unseen

THETA = np.array([2.2e5, 0.30, 3e-3, 1.0, 1.0])
GRASP, LIFTED, DRAWN, RELEASE = 0.1, 0.7, 1.8, 2.0  # s
DRAW, DROP = 0.38, 0.15  # m
PULLS = (0.30, 1), (0.45, 2)  # Poisson's ratio, and rings of the section that are enough for it
LAUNCHES = (  # Young's modulus, Poisson's ratio, damping, draw
    (2.2e5, 0.30, 2e-3, (-0.32, -0.12)),
    (2.2e5, 0.45, 5e-3, (-0.36, -0.15)),
    (1.5e5, 0.40, 2e-3, (-0.40, -0.15)),
    (3.0e5, 0.35, 5e-3, (-0.30, -0.20)),
    (1.8e5, 0.45, 1e-3, (-0.35, -0.10)),
    (2.5e5, 0.30, 8e-3, (-0.33, -0.25)),
)
TEXT = """\
MuJoCo simulates the same band with another element (tetrahedra, 7 or 19 vertices a section),
another integrator (one linearised step of backward Euler) and another solver. The law is the same;
d times the rate of the whole elastic stress (damping_scale 1) means the same, and MuJoCo's d is
less by its step, which damps as much. Both idealise alike: clamps and fingers hold a whole section,
along `setup.clamp_direction` and along the fork, and neither turn nor deform it; the hand keeps
its path and the band does not slip in it; the projectile is a mass at the middle section, drawn to
rest, let go at once and gone at the first pull; there is no air. What is left of a difference while
the band is slack, and where it becomes taut, is mostly the bending of coarse tetrahedra: it is
several times too stiff, the more so the closer Poisson's ratio is to 0.5, and finer sections come
closer to our figures."""


@dataclass(frozen=True)
class EnginePull:
    """Pull in both engines, while the hand holds the band.

    Attributes:
        times: Of the forces [s], shape (S,).
        force: Ours and MuJoCo's on the hand [N], shape (2, S, 3).
        frames: Stamps of the centre lines [s], shape (K,).
        lines: Ours and MuJoCo's at the same places along the band [m], shape (2, K, L, 3).
    """

    times: np.ndarray
    force: np.ndarray
    frames: np.ndarray
    lines: np.ndarray

    @property
    def force_error(self) -> float:
        """Largest difference of the forces over the largest force [%]."""
        ours, theirs = self.force
        peak = np.linalg.norm(ours, axis=1).max()
        return float(100 * np.linalg.norm(theirs - ours, axis=1).max() / peak)

    @property
    def held_error(self) -> float:
        """Difference of the forces at the end of the hold [%]."""
        ours, theirs = np.linalg.norm(self.force[:, -1], axis=1)
        return float(100 * (theirs / ours - 1))

    @property
    def line_errors(self) -> np.ndarray:
        """RMS distance of the centre lines in each frame [mm], shape (K,)."""
        distance = np.linalg.norm(self.lines[1] - self.lines[0], axis=-1)
        return 1e3 * np.sqrt((distance**2).mean(axis=1))


def episode_of(sling: ClampedBand) -> Episode:
    """Lift, pull to (-DRAW, -DROP) and hold; a camera at 30 Hz."""
    t = np.arange(0.0, RELEASE + 0.5, 0.01)
    hang = np.sqrt(sling.rest_length**2 / 4 - sling.half_width**2)
    lift, pull = ease(t, GRASP, LIFTED), ease(t, LIFTED - 0.1, DRAWN)
    position = np.stack([0 * t, -DRAW * pull, hang * (lift - 1) - DROP * pull], axis=1)
    stamps = np.arange(np.ceil(30 * GRASP), 30 * t[-1]) / 30
    return unseen("peers", t, position, stamps, GRASP, RELEASE)


def pull(bench: Bench, theta, step: float = 5e-4, **mesh) -> EnginePull:
    """The same episode in both engines.

    Args:
        step: MuJoCo's [s].
        mesh: As in `Tube.of`.

    Raises:
        UserError: MuJoCo is not installed.
    """
    sling = sling_of(bench)
    episode = episode_of(sling)
    theirs = mujoco_flex.interact(sling, episode, theta, step, **mesh)
    ours = interact(sling, episode, damped(theta), device=bench.device)
    force = _interpolate(theirs.times, ours.times, ours.force[0])
    first = int(np.searchsorted(episode.cloud_time, theirs.cloud_time[0]))
    frames = ours.center_line[0, first : first + len(theirs.cloud_time)]
    lines = np.array([_interpolate(theirs.arc, sling.arc, line) for line in frames])
    return EnginePull(
        times=theirs.times,
        force=np.array([force, theirs.force]),
        frames=theirs.cloud_time,
        lines=np.array([lines, theirs.center_line]),
    )


def pull_checks(result: EnginePull, title: str) -> list[Measure]:
    """Force and centre line."""
    worst = result.line_errors
    frame = int(worst.argmax())
    return [
        Measure(
            f"force on the hand while held, of its peak, {title}",
            "MuJoCo 3D flex",
            result.force_error,
            "%",
            2.0,
            f"{result.held_error:+.2f} % at the end of the hold",
        ),
        Measure(
            f"centre line while held, rms, {title}",
            "MuJoCo 3D flex",
            float(np.sqrt((worst**2).mean())),
            "mm",
            5.0,
            f"at most {worst[frame]:.1f} mm in a frame, at {result.frames[frame]:.2f} s",
        ),
    ]


def launch_check(bench: Bench, cases=LAUNCHES, step: float = 2.5e-4) -> Measure:
    """The largest difference of the landings of `cases`, as listed in LAUNCHES."""
    sling, setup = sling_of(bench), setup_of(bench)
    thetas = np.array([[young, poisson, d, 1.0, 1.0] for young, poisson, d, _ in cases])
    draws = np.array([draw for *_, draw in cases])
    ours = launch(sling, setup, damped(thetas), draws, device=bench.device)
    theirs = [
        mujoco_flex.launch(sling, setup, theta, draw, step)
        for theta, draw in zip(thetas, draws, strict=True)
    ]
    landing = 100 * (np.array([flight.landing_y for flight in theirs]) / ours.landing_y - 1)
    speed = 100 * (np.array([flight.speed for flight in theirs]) / ours.speed - 1)
    hold = 100 * (np.array([flight.hold_force for flight in theirs]) / ours.hold_force - 1)
    return Measure(
        f"landing of {len(cases)} launches, the largest difference",
        "MuJoCo 3D flex",
        float(np.abs(landing).max()),
        "%",
        3.0,
        f"landings {', '.join(f'{x:+.1f}' for x in landing)} %; speeds within"
        f" {np.abs(speed).max():.1f} %, forces of the draw within {np.abs(hold).max():.1f} %",
    )


def section(bench: Bench) -> Theme:
    """All comparisons.

    Raises:
        UserError: MuJoCo is not installed.
    """
    checks = []
    for poisson, rings in PULLS:
        theta = THETA.copy()
        theta[1] = poisson
        title = f"Poisson's ratio {poisson:.2f}, {900 * rings**2} tetrahedra"
        checks += pull_checks(pull(bench, theta, rings=rings), title)
    return Theme("Against MuJoCo", [*checks, launch_check(bench)], TEXT)


def sling_of(bench: Bench) -> ClampedBand:
    """The proofs' band, mounted as `setup` says."""
    return band_of(bench)  # without air, as MuJoCo


def damped(thetas: np.ndarray) -> Parameters:
    """Parameters of thetas (N, 5): MuJoCo damps the rate of the nominal stress."""
    return Parameters.of(NEO_HOOKEAN, thetas, turn_damping=1.0)


def _interpolate(at: np.ndarray, places: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Rows (P, 3) at ascending `places` (P,), read at `at` (Q,): shape (Q, 3)."""
    return np.stack([np.interp(at, places, column) for column in rows.T], axis=1)
