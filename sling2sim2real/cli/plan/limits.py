"""What a plan must keep to. Each check raises a UserError: which limit, by how much, what to do."""

from __future__ import annotations

import math

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.cli.plan.force import Held, Prediction
from sling2sim2real.cli.plan.pull import BACK
from sling2sim2real.cli.plan.trajectory import Trajectory
from sling2sim2real.episode.planned import PULL
from sling2sim2real.settings.lab import PlanParams, SetupParams
from sling2sim2real.settings.recording import EpisodeParams
from sling2sim2real.simulator.model import BandSizes

ROUNDING = 1e-6  # relative
LEAST_STRETCH = 1.10  # below it the drawn band shows little of its rubber
LEAD = 0.1  # s of the lead-in that the episode holds at least
MOST_ASKEW = 60.0  # degrees between the fingers and the way to the fork


def check_draw(setup: SetupParams, held: Held, drawn: np.ndarray) -> None:
    """The draw (3,) lies where the arm reaches, or at the tips' height, and stretches the band."""
    for axis, value, low, high in (
        ("y", drawn[1], setup.draw_y[0], 0.0),
        ("z", drawn[2], setup.draw_z[0], max(setup.draw_z[1], 0.0)),
    ):
        nearest = min(max(value, low), high)
        if value != nearest:
            raise UserError(
                f"the draw's {axis} = {value:g} m lies {abs(value - nearest):.3g} m beyond the"
                f" {nearest:g} m of setup.draw_{axis}: draw less far (plan.draw or --draw), or"
                " widen it if the arm reaches"
            )
    stretch = held.stretch(drawn)
    if stretch < LEAST_STRETCH:
        size, far = math.hypot(*drawn), 10 * held.rest_length
        direction = drawn / np.abs(drawn).max()
        direction /= np.linalg.norm(direction)
        least = far * held.reach(held.stretch, LEAST_STRETCH, far * direction)
        raise UserError(
            f"the draw stretches the band to {stretch:.2f} of its rest length, less than"
            f" {LEAST_STRETCH:g}: draw by {least:.3f} m at least, not {size:.3f} m"
            " (plan.draw or --draw)"
        )


def check_hand(plan: PlanParams, band: BandSizes, axis: np.ndarray, drawn: np.ndarray) -> None:
    """The open fingers take the band, and point to the fork from the draw."""
    if plan.gripper.open <= band.diameter:
        raise UserError(
            f"plan.gripper.open: {plan.gripper.open:g} m is no wider than the band,"
            f" {band.diameter:g} m thick"
        )
    cosine = float(axis @ -drawn / np.linalg.norm(drawn))
    angle = float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
    if angle > MOST_ASKEW:
        raise UserError(
            f"plan.orientation: the fingers (z) would point {angle:.0f} degrees away from the fork,"
            f" more than {MOST_ASKEW:g}: it is x, y, z, w of the hand in the robot's base, or null"
        )


def check_dips(plan: PlanParams) -> None:
    """Check that each dip stays between the fork and the draw."""
    size = math.hypot(*plan.draw)
    for number, dip in enumerate(plan.dips):
        if dip.depth >= dip.at * size:
            raise UserError(
                f"plan.dips: dip {number + 1} lets the band back by {dip.depth:g} m from"
                f" {dip.at * size:.3g} m, and would pass the fork: make it less deep"
            )


def check_motion(trajectory: Trajectory, plan: PlanParams) -> None:
    """Largest speed and acceleration of every phase."""
    speeds, accelerations = trajectory.peaks(1), trajectory.peaks(2)
    for phase, speed, acceleration in zip(trajectory.phases, speeds, accelerations, strict=True):
        name = "pull_speed" if phase.name == PULL else "max_speed"
        where = " (plan.dips)" if phase.name in BACK else ""
        for value, limit, key, unit in (
            (speed, getattr(plan, name), name, "m/s"),
            (acceleration, plan.max_acceleration, "max_acceleration", "m/s^2"),
        ):
            if value > limit * (1 + ROUNDING):
                raise UserError(
                    f"the {phase.name}{where} reaches {value:.3g} {unit}, {value - limit:.3g} more"
                    f" than plan.{key} {limit:g}: give it more than {phase.duration:.3g} s"
                )


def check_floor(trajectory: Trajectory, setup: SetupParams, plan: PlanParams) -> None:
    """The hand keeps clear of the floor; legs are straight, so their ends tell."""
    heights = trajectory.position(trajectory.times)[:, 2] + setup.fork_height
    lowest = int(np.argmin(heights))
    if heights[lowest] < plan.floor_clearance:
        name = trajectory.phases[max(lowest - 1, 0)].name
        raise UserError(
            f"the {name} brings the hand to {heights[lowest]:.3f} m above the floor,"
            f" {plan.floor_clearance - heights[lowest]:.3f} m less than plan.floor_clearance"
            f" {plan.floor_clearance:g}: raise the fork (setup.fork_height), or lower that limit"
        )


def check_window(
    trajectory: Trajectory, plan: PlanParams, episode: EpisodeParams
) -> tuple[float, float]:
    """Grasp to release fits the episode. Returns what it takes, and what there is for it [s]."""
    taken = trajectory.start_of("release") - trajectory.start_of("grasp")
    most = episode.longest - episode.tail - LEAD
    over = taken - most
    if over > ROUNDING:
        advice = f"raise episode.longest to {np.ceil(10 * (episode.longest + over)) / 10:g}"
        if plan.dips:
            advice = f"take --pull paper, or shorter plan.dips, or {advice}"
        if plan.pull_speed < plan.max_speed:
            advice = f"raise plan.pull_speed, or {advice}"
        raise UserError(
            f"from grasp to release it takes {taken:.2f} s, {over:.2f} s more than episode.longest"
            f" {episode.longest:g} less episode.tail {episode.tail:g} and {LEAD:g} s leave:"
            f" {advice}"
        )
    return taken, most


def check_force(setup: SetupParams, held: Held, drawn: np.ndarray, prediction: Prediction) -> None:
    """Holding the band takes no more than the arm may; nothing to check where it is not known."""
    force = prediction.force
    if force is None or force <= setup.max_force:
        return
    limit = setup.max_force / force * held.force(drawn)
    _, y, z = held.reach(held.force, limit, drawn) * drawn
    y, z = np.trunc(100 * np.array([y, z])) / 100  # towards the fork
    advice = f"draw less far, such as --draw={y:.2f},{z:.2f}"
    if held.stretch(np.array([0.0, y, z])) < LEAST_STRETCH:
        advice = "the band is too stiff for this arm"
    raise UserError(
        f"holding draw [{drawn[1]:g}, {drawn[2]:g}] takes {force:.1f} N ({prediction.source}),"
        f" {force - setup.max_force:.1f} N more than setup.max_force {setup.max_force:g}:"
        f" {advice}"
    )
