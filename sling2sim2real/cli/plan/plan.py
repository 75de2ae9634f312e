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
from sling2sim2real.cli.plan.force import Held, Prediction, predict
from sling2sim2real.cli.plan.hand import along_pull, quaternion
from sling2sim2real.cli.plan.pull import hanging_middle, trajectory_of
from sling2sim2real.cli.plan.trajectory import Trajectory
from sling2sim2real.cli.preflight.check import MASS, expect_long
from sling2sim2real.recording.frames import FORK
from sling2sim2real.recording.transforms import Transform
from sling2sim2real.settings import Settings
from sling2sim2real.settings.lab import Gripper

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
        band: Its name.
        trajectory: Of the tool centre point, frame O.
        base: Frame O to the robot's base; the identity where nothing tells it.
        base_source: Where that came from, in words; None: from nowhere, all is in frame O.
        frame: Name of the base, or of frame O.
        hand: Orientation of the hand there, quaternion x, y, z, w.
        gripper: Its settings.
        stretch: Of the drawn band.
        force: Predicted, to hold it.
        max_force: That the arm may hold [N].
        grip_force: Of each finger [N].
        held_time, most_time: From grasp to release, and what the episode leaves for it [s].
        hanging_source: Where the height of the hanging middle came from.
        pull: Of PULLS.
        dips: How many the pull has.
    """

    band: str
    trajectory: Trajectory
    base: Transform
    base_source: str | None
    frame: str
    hand: np.ndarray
    gripper: Gripper
    stretch: float
    force: Prediction
    max_force: float
    grip_force: float
    held_time: float
    most_time: float
    hanging_source: str
    pull: str
    dips: int

    def rows(self) -> list[dict]:
        """One row a phase, numbers in SI units."""
        trajectory = self.trajectory
        speeds, accelerations = trajectory.peaks(1), trajectory.peaks(2)
        return [
            {
                "phase": phase.name,
                "start_s": round(float(trajectory.times[i]), 6),
                "end_s": round(float(trajectory.times[i + 1]), 6),
                "fork": _plain(phase.to),
                "base": _plain(self.base.apply(phase.to)),
                "opening_m": float(phase.opening),
                "max_speed_m_s": float(speeds[i]),
                "max_acceleration_m_s2": float(accelerations[i]),
            }
            for i, phase in enumerate(trajectory.phases)
        ]

    def content(self) -> dict:
        """Everything that the plan says of itself, for JSON."""
        return {
            "band": self.band,
            "frame": self.frame,
            "base_to_fork": self._fork_in_base,
            "base_to_fork_source": self.base_source,
            "orientation": _plain(self.hand),
            "hanging_source": self.hanging_source,
            "duration_s": round(self.trajectory.duration, 6),
            "grasp_s": round(self.trajectory.start_of("grasp"), 6),
            "release_s": round(self.trajectory.start_of("release"), 6),
            "pulls": sum(phase.name == "release" for phase in self.trajectory.phases),
            "held_s": round(self.held_time, 6),
            "held_most_s": round(self.most_time, 6),
            "pull": self.pull,
            "dips": self.dips,
            "stretch": self.stretch,
            "hold_force_n": self.force.force,
            "hold_force_source": self.force.source,
            "max_force_n": self.max_force,
            "phases": self.rows(),
        }

    @property
    def _fork_in_base(self) -> list[float] | None:
        if self.base_source is None:
            return None
        return [*_plain(self.base.translation), *_plain(quaternion(self.base.rotation))]

    def to_json(self, files: list[Path]) -> str:
        written = [str(path) for path in files]
        return json.dumps({**self.content(), "files": written}, indent=2, allow_nan=False)

    def to_text(self, files: list[Path]) -> str:
        places = "fork", "base"
        table = [
            {**row, **{place: " ".join(f"{v:+.4f}" for v in row[place]) for place in places}}
            for row in self.rows()
        ]
        heads = {name: name.replace("_", " ") for name in table[0]}
        heads |= {"fork": "to, frame O [m]", "base": f"in {self.frame} [m]"}
        force = self.force
        holds = f"{force.force or 0:.1f} N of {self.max_force:g} N ({force.source})"
        facts = {
            "hand": f"{' '.join(f'{v:+.4f}' for v in self.hand)} (x y z w in {self.frame})",
            "fork": f"in {self.frame} by {self.base_source}" if self.base_source else NO_BASE,
            "middle": self.hanging_source,
            "pull": f"{self.pull}, with {self.dips} dip{'s' * (self.dips != 1)}",
            "window": f"grasp to release {self.held_time:.2f} s of {self.most_time:.2f} s",
            "stretch": f"{self.stretch:.2f} of the rest length",
            "force": force.source if force.force is None else holds,
        }
        lines = [tabulate(table, heads, tablefmt="plain", floatfmt=".3f"), ""]
        lines += [*(f"{name:<10}{value}" for name, value in facts.items()), ""]
        return "\n".join([*lines, *(f"wrote {path}" for path in files)])

    def write(self, folder: Path, rate: float) -> list[Path]:
        """Write trajectory.csv, waypoints.json and gripper.json into a folder.

        Everything is made before the first file is written. Raises UserError.
        """
        pose = self.trajectory, self.base, self.hand
        table = messages.csv_text(*pose, rate)
        waypoints = messages.trajectory_message(*pose, self.frame)
        gripper = messages.gripper_commands(self.trajectory, self.gripper.command, self.grip_force)
        names = ("trajectory.csv", "waypoints.json", "gripper.json")
        files = [Path(folder, name) for name in names]
        try:
            write_text(files[0], table)
            write_json(files[1], waypoints)
            write_json(files[2], gripper)
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
    return Plan(
        band=band.name,
        trajectory=trajectory,
        base=base,
        base_source=source,
        frame=frame,
        hand=quaternion(hand),
        gripper=settings.gripper,
        stretch=held.stretch(drawn),
        force=prediction,
        max_force=setup.max_force,
        grip_force=setup.grip_force,
        held_time=held_time,
        most_time=most_time,
        hanging_source=f"hangs {below:.3f} m below the tips ({by})",
        pull=pull,
        dips=len(dips),
    )


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
