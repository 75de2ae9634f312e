"""`sling plan`: how a robot has to move so that its recording of a band can be used."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation
from tabulate import tabulate

from sling2sim2real.api.arguments import USUAL
from sling2sim2real.api.band_folder import BandFolder, lab_settings
from sling2sim2real.api.identification import Identification
from sling2sim2real.api.model import Band
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import write_json, write_text
from sling2sim2real.cli.arguments import PULLS
from sling2sim2real.cli.command_line import say
from sling2sim2real.cli.plan import limits, messages
from sling2sim2real.cli.plan.force import Held, predict
from sling2sim2real.cli.plan.hand import along_pull, quaternion
from sling2sim2real.cli.plan.pull import hanging_middle, trajectory_of
from sling2sim2real.cli.plan.trajectory import Trajectory
from sling2sim2real.cli.preflight.check import MASS, expect_long
from sling2sim2real.recording.frames import FORK
from sling2sim2real.recording.transforms import Transform
from sling2sim2real.settings import Settings

INFORMATIVE, PAPER = PULLS
MOST_PULLS = 10  # a file of them is half a gigabyte
NO_BASE = (
    "nothing says where it stands in the robot's base, so all is in frame O, which no robot knows:"
    " `sling setup` asks for it, and a band knows it that was identified with it"
)


@dataclass(frozen=True)
class Plan:
    """A recording to be made.

    Attributes:
        trajectory: Of the tool centre point, frame O.
        base: Frame O to the robot's base; the identity where nothing tells it.
        hand: Its orientation in the base, quaternion x, y, z, w.
        commands: Of the gripper, as messages.gripper_commands has them.
        about: What the plan says of itself, as `--json` prints it and plan.json keeps it.
    """

    trajectory: Trajectory
    base: Transform
    hand: np.ndarray
    commands: list[dict]
    about: dict

    def to_json(self, files: list[Path]) -> str:
        written = {"files": [str(path) for path in files]}
        return json.dumps(self.about | written, indent=2, allow_nan=False)

    def to_text(self, files: list[Path]) -> str:
        about, places = self.about, ("fork", "base")
        table = [
            row | {place: " ".join(f"{v:+.4f}" for v in row[place]) for place in places}
            for row in about["phases"]
        ]
        frame, force = about["frame"], about["hold_force_source"]
        heads = {name: name.replace("_", " ") for name in table[0]}
        heads |= {"fork": "to, frame O [m]", "base": f"in {frame} [m]"}
        if about["hold_force_n"] is not None:
            force = f"{about['hold_force_n']:.1f} N of {about['max_force_n']:g} N ({force})"
        source, dips = about["base_to_fork_source"], about["dips"]
        facts = {
            "hand": f"{' '.join(f'{v:+.4f}' for v in self.hand)} (x y z w in {frame})",
            "fork": f"in {frame} by {source}" if source else NO_BASE,
            "middle": about["hanging_source"],
            "pull": f"{about['pull']}, with {dips} dip{'s' * (dips != 1)}",
            "window": f"grasp to release {about['held_s']:.2f} s of {about['held_most_s']:.2f} s",
            "stretch": f"{about['stretch']:.2f} of the rest length",
            "force": force,
        }
        lines = [tabulate(table, heads, tablefmt="plain", floatfmt=".3f"), ""]
        lines += [*(f"{name:<10}{value}" for name, value in facts.items()), ""]
        return "\n".join([*lines, *(f"wrote {path}" for path in files)])

    def write(self, folder: Path, rate: float) -> list[Path]:
        """Write trajectory.csv, gripper.json and plan.json into a folder. Raises UserError."""
        files = [Path(folder, name) for name in ("trajectory.csv", "gripper.json", "plan.json")]
        try:
            write_text(files[0], messages.csv_text(self.trajectory, self.base, self.hand, rate))
            write_json(files[1], self.commands)
            write_json(files[2], self.about)
        except OSError as error:
            raise UserError(f"{folder}: cannot be written ({error.strerror})") from error
        return files


class KnownBand(NamedTuple):
    """What a plan is made for; `found` of a band that was identified."""

    settings: Settings
    band: Band
    found: Identification | None


def known_band(place: Path | None, sizes: dict[str, float]) -> KnownBand:
    """The band of a folder, or one to come of some sizes and usual ones.

    Raises:
        UserError: Neither a folder nor sizes, or both.
    """
    if place is None:
        if not sizes:
            raise UserError("give a band's folder, or --diameter and --rest-length of one to come")
        whole = {"mass": MASS, **USUAL, **sizes}
        if taken := [f"--{n.replace('_', '-')} {USUAL[n]:g}" for n in USUAL if n not in sizes]:
            say(f"assumed: {' and '.join(taken)}")
        settings = lab_settings()
        expect_long(whole["rest_length"], settings.setup)
        return KnownBand(settings, Band(**whole, name="new"), None)
    folder = BandFolder.at(place)
    if sizes:
        raise UserError(f"{folder.band_file} has the band's sizes: leave these out")
    found = Identification.load(folder.path) if folder.theta.is_file() else None
    return KnownBand(folder.settings, folder.band, found)


def plan_recording(
    params: Settings,
    band: Band,
    *,
    found: Identification | None = None,
    draw: tuple[float, float] | None = None,
    pull: str = INFORMATIVE,
    pulls: int = 1,
) -> Plan:
    """Plan the recording of a band and check it against every limit.

    Where the fork stands in the robot's base is taken from setup.base_to_fork, else from what was
    identified; else all is in frame O.

    Args:
        params: Settings of the lab.
        band: Whose recording it is to be.
        found: The band, where it has been identified: it tells the force.
        draw: Drawn position (y, z), frame O [m]; plan.draw if None.
        pull: INFORMATIVE with plan.dips, PAPER without.
        pulls: How many in one recording; between two the hand returns and grasps again.

    Raises:
        UserError: in one line, where a limit is broken or something is not known.
    """
    if pulls > MOST_PULLS:
        raise UserError(f"--pulls: at most {MOST_PULLS} in one recording, got {pulls}")
    setup = params.setup
    settings = params.plan if draw is None else params.plan.model_copy(update={"draw": draw})
    base, source, frame = _standing(params, found)
    if source is None and settings.orientation is not None:
        raise UserError(f"plan.orientation is the hand's in the robot's base: {NO_BASE}")
    drawn = np.array([0.0, *settings.draw])
    held = Held.of(band, setup)
    limits.check_draw(setup, held, drawn)
    given = settings.orientation  # else it looks along the pull at the fork
    hand = Rotation.from_quat(given) if given else base.rotation * along_pull(drawn)
    axis = (base.rotation.inv() * hand).apply([0.0, 0.0, 1.0])
    limits.check_hand(settings, band, axis, drawn)
    prediction = predict(held, drawn, found)

    dips = settings.dips if pull == INFORMATIVE else ()
    plan = settings.model_copy(update={"dips": dips})
    limits.check_dips(plan)
    trajectory = trajectory_of(plan, setup, params.episode, band, axis, pulls)
    limits.check_motion(trajectory, plan)
    limits.check_floor(trajectory, setup, plan)
    held_time, most_time = limits.check_window(trajectory, plan, params.episode)
    limits.check_force(setup, held, drawn, prediction)
    below = -hanging_middle(settings, setup, band)[2]
    by = "as a string's catenary" if settings.hanging is None else "plan.hanging"
    turn, position = quaternion(hand), settings.gripper.command
    about = {
        "band": band.name,
        "frame": frame,
        "base_to_fork": source and [*_plain(base.translation), *_plain(quaternion(base.rotation))],
        "base_to_fork_source": source,
        "orientation": _plain(turn),
        "hanging_source": f"hangs {below:.3f} m below the tips ({by})",
        "duration_s": round(trajectory.duration, 6),
        "grasp_s": round(trajectory.start_of("grasp"), 6),
        "release_s": round(trajectory.start_of("release"), 6),
        "pulls": pulls,
        "held_s": round(held_time, 6),
        "held_most_s": round(most_time, 6),
        "pull": pull,
        "dips": len(dips),
        "stretch": held.stretch(drawn),
        "hold_force_n": prediction.force,
        "hold_force_source": prediction.source,
        "max_force_n": setup.max_force,
        "phases": _rows(trajectory, base),
    }
    commands = messages.gripper_commands(trajectory, position, setup.grip_force)
    return Plan(trajectory, base, turn, commands, about)


def _rows(trajectory: Trajectory, base: Transform) -> list[dict]:
    """One row a phase, numbers in SI units."""
    speeds, accelerations = trajectory.peaks(1), trajectory.peaks(2)
    return [
        {
            "phase": phase.name,
            "start_s": round(float(trajectory.times[i]), 6),
            "end_s": round(float(trajectory.times[i + 1]), 6),
            "fork": _plain(phase.to),
            "base": _plain(base.apply(phase.to)),
            "opening_m": float(phase.opening),
            "max_speed_m_s": float(speeds[i]),
            "max_acceleration_m_s2": float(accelerations[i]),
        }
        for i, phase in enumerate(trajectory.phases)
    ]


def _standing(params: Settings, found: Identification | None) -> tuple[Transform, str | None, str]:
    """Frame O to the robot's base, where that came from (None: from nowhere), the base's name."""
    if params.setup.base_to_fork is not None:
        fork = Transform.of(params.setup.base_to_fork)
        return fork, "setup.base_to_fork", params.plan.frame
    if found is not None and found.fork is not None:
        source = "the recording that it was identified from"
        return Transform.of(found.fork.pose), source, found.fork.frame or params.plan.frame
    return Transform.identity(), None, FORK


def _plain(vector: np.ndarray) -> list[float]:
    return [round(float(value), 9) + 0.0 for value in vector]
