"""What it takes to hold the drawn band, as far as anything is known of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np
from scipy.optimize import brentq

from sling2sim2real.api.identification import Identification
from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.transforms import Transform
from sling2sim2real.settings import Settings
from sling2sim2real.settings.lab import SetupParams
from sling2sim2real.simulator.model import BandSizes

ALIKE = 0.02  # relative: stretches that are as good as equal
GENTLE = 1.25  # stretch of a first pull, where nothing is known of the force


@dataclass(frozen=True)
class Earlier:
    """What an earlier recording of this rig and band tells.

    Attributes:
        path: The file.
        base: Robot's base to frame O.
        base_source: Where that came from, in words.
        frame: Name of the base.
        force: Held at its release [N], None where it has no pull that can be used.
        drawn: Where the hand was then, frame O [m], shape (3,).
        problem: Why there is no force, in one line.
    """

    path: Path
    base: Transform
    base_source: str
    frame: str
    force: float | None
    drawn: np.ndarray | None
    problem: str | None


def read_earlier(path: Path, params: Settings) -> Earlier:
    """Read a recording as far as a plan needs it: no pictures. Raises UserError.

    Of several pulls, the first that can be used.
    """
    from sling2sim2real.recording.events import Pull, parts_of
    from sling2sim2real.recording.frames import geometry_of
    from sling2sim2real.recording.signals import signals_of
    from sling2sim2real.recording.streams import read_recording

    recording = read_recording(Path(path), params.setup, params.episode.delays)
    geometry = geometry_of(recording, params.setup)
    base, source = geometry.base, geometry.sources["base_to_fork"]
    frame, problem = recording.pose.frame, None
    try:
        for part in parts_of(recording, geometry):
            try:
                signals = signals_of(Pull.of(part), params)
            except UserError as error:
                problem = problem or f"{path}: {str(error).removeprefix(f'{path}: ')}"
                continue
            force = float(np.linalg.norm(signals.facts.hold_force))
            drawn = signals.hand(signals.release_time)
            return Earlier(path, base, source, frame, force, drawn, None)
    except UserError as error:
        problem = f"{path}: {error}"
    return Earlier(path, base, source, frame, None, None, problem)


@dataclass(frozen=True)
class Held:
    """The band held at a point by a string of neo-Hookean rubber, but for one factor.

    Its tension is in proportion to l - 1 / l^2 at a stretch l (Treloar 1975): the recorded force of
    one draw gives that of another, the better the less the stretches differ. From 1.63 to between
    1.3 and 2.1 it is 2 % off the simulator, and 11 to 13 % off the virtual rig's rubber.
    """

    half_width: float
    rest_length: float

    @classmethod
    def of(cls, band: BandSizes, setup: SetupParams) -> Held:
        return cls(setup.fork_width / 2, band.rest_length)

    def legs(self, point: np.ndarray) -> tuple[float, float]:
        """Stretch, and length of the sum of both halves' unit vectors."""
        ways = np.array([[-self.half_width, 0.0, 0.0], [self.half_width, 0.0, 0.0]]) - point
        lengths = np.linalg.norm(ways, axis=1)
        both = float(np.linalg.norm((ways / lengths[:, None]).sum(axis=0)))
        return float(lengths.sum()) / self.rest_length, both

    def stretch(self, point: np.ndarray) -> float:
        """Way from tip to point (3,) to tip, over the rest length."""
        return self.legs(point)[0]

    def force(self, point: np.ndarray) -> float:
        """Band's force on the hand at a point (3,), in units of a third of E A; 0 where slack."""
        stretch, both = self.legs(point)
        return max(stretch - stretch**-2, 0.0) * both

    def reach(self, value: Callable[[np.ndarray], float], limit: float, drawn: np.ndarray) -> float:
        """Share of the way to `drawn` (3,) at which a value that grows along it meets a limit."""
        part = brentq(lambda part: value(part * drawn) - limit, 1e-6, 1.0)
        return cast(float, part)


@dataclass(frozen=True)
class Prediction:
    """Force at the planned draw [N], None where nothing is known, and the source in words."""

    force: float | None
    source: str


def predict(
    held: Held, drawn: np.ndarray, found: Identification | None, earlier: Earlier | None
) -> Prediction:
    """The force at `drawn` (3,): by the simulator, else by an earlier recording, else unknown."""
    stretch = held.stretch(drawn)
    if found is not None:
        return Prediction(_simulated(found, drawn), "simulated with its θ")
    if earlier and earlier.force is not None and earlier.drawn is not None:
        was = held.stretch(earlier.drawn)
        if was <= 1:
            raise UserError(
                f"{earlier.path}: holds {earlier.force:.1f} N where the band should be slack, at"
                f" {was:.2f} of its rest length {held.rest_length:g} m: correct that length,"
                " or give a recording of this band"
            )
        force = earlier.force * held.force(drawn) / held.force(earlier.drawn)
        source = f"{earlier.path} held {earlier.force:.2f} N at stretch {was:.2f}"
        if abs(stretch / was - 1) > ALIKE:
            source += ", scaled to this stretch: good to 15 % or so"
        if stretch > (1 + ALIKE) * was:
            source += ", and beyond that stretch a band may stiffen"
        return Prediction(force, source)
    why = "the band is not identified, and no recording was given"
    if earlier is not None:
        why = earlier.problem
    advice = ""
    if stretch > GENTLE:
        _, y, z = held.reach(held.stretch, GENTLE, drawn) * drawn
        advice = (
            f": begin with a shallow pull, --draw={y:.2f},{z:.2f}, and give its recording to the"
            " next plan with --recording"
        )
    return Prediction(None, f"not checked: {why}; the band is stretched to {stretch:.2f}{advice}")


def _simulated(found: Identification, drawn: np.ndarray) -> float:
    force = float(found.launches(drawn[1:]).hold_force[0])
    if not np.isfinite(force):
        raise UserError(
            f"{found.band.name}: the simulated hold of draw [{drawn[1]:g}, {drawn[2]:g}] does not"
            " converge: draw less far"
        )
    return force
