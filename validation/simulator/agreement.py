"""The kernel against its NumPy reference: the same steps of the same bands, in double precision."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.simulator.initial import drawn_guess, hanging_guess
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.records import Grip
from sling2sim2real.simulator.schedule import relaxation, steps
from validation.simulator.experiment import (
    TIGHT,
    band_of,
    launched,
    move,
    rest,
    straight,
    straight_guess,
)
from validation.simulator.finding import Bench, Measure, Theme
from validation.simulator.march import march
from validation.simulator.reference import ReferenceRod

LIMIT = 1e-7  # of the band's motion, or of its pull
SEED = 7


def random_thetas(bench: Bench, count: int, seed: int = SEED) -> np.ndarray:
    """Random thetas of the box in params.yaml, shape (count, 5)."""
    unit = np.random.default_rng(seed).random((count, 5))
    return SearchBox.of(bench.params.parameters).to_physical(unit)


@dataclass(frozen=True)
class Start:
    """A band at rest in one way (`before`, from `guess`), and steps of it in another.

    Attributes:
        before: None where the steps begin from the guess itself.
        turned: How far the sections are turned about the band before the steps, in its middle.
    """

    sling: ClampedBand
    steps: np.ndarray
    guess: np.ndarray
    before: ClampedBand | None = None
    grip: Grip = Grip.FREE
    payload: float = 0.0
    turned: float = 0.0


def _turned(sling: ClampedBand, sections: np.ndarray, most: float) -> np.ndarray:
    """Sections (L, 9) with their sections turned about the band, by `most` in its middle."""
    angle = most * np.sin(np.pi * sling.arc / sling.rest_length)[:, None]
    a, b = sections[:, 3:6], sections[:, 6:]
    turned = np.cos(angle) * a + np.sin(angle) * b, np.cos(angle) * b - np.sin(angle) * a
    return np.hstack([sections[:, :3], *turned])


def scenes(sling: ClampedBand, payload: float) -> dict[str, Start]:
    """Every way to hold a band, and both orders of steps; the launch of a payload [kg]."""
    path = np.linspace([0.0, 0.0, -0.2], [0.01, -0.03, -0.18], 8)
    held = steps(0.002 * np.arange(9), 0.002, grip=Grip.HELD)
    held["target"], held["grip_force"], held["blend"] = path, 1e4, np.linspace(1, 0.3, 8)
    opening = steps(0.016 + 0.00025 * np.arange(9), 0.002, grip=Grip.OPENING, order=2)
    opening["grip_force"] = sling.grip_force * np.linspace(0, 1, 8)
    free = steps(0.018 + 0.0005 * np.arange(9), 0.00025, grip=Grip.FREE, order=2)
    draw = np.array([[-0.38, -0.2]])
    taut = straight(sling, 1.3 * sling.rest_length)
    loose = replace(taut, clamped=(False, False))
    start = straight_guess(taut)
    return {
        "held, opened and let go": Start(
            sling, np.concatenate([held, opening, free]), hanging_guess(sling)
        ),
        "brought to rest": Start(sling, relaxation(Grip.FREE)[:12], hanging_guess(sling)),
        "launched": Start(
            sling,
            launched(0.00025, 16),
            drawn_guess(sling, draw)[0],
            before=sling,
            grip=Grip.POUCH,
            payload=payload,
        ),
        "twisted and let go": Start(taut, launched(0.0005, 12, 1), start, before=taut, turned=0.3),
        "stretched and let go at both ends": Start(loose, launched(0.0005, 12), start, before=taut),
    }


def compare(
    bench: Bench, thetas: np.ndarray, sling: ClampedBand | None = None, **others: float
) -> dict[str, tuple[float, float]]:
    """Largest difference of a scene's states and forces, by what the reference says they do.

    `others` are parameters beside thetas (N, 5).
    """
    result = {}
    mass = bench.params.setup.projectile_mass
    for name, scene in scenes(sling or band_of(bench), mass).items():
        states, forces = [], []
        for sample in thetas:
            theta = Parameters.of(scene.sling.law, sample, **others)
            start = scene.guess.copy()
            if scene.before is not None:
                table = relaxation(scene.grip)
                table["target"] = scene.guess[scene.sling.middle, :3]
                start = rest(bench, scene.before, theta, start, table=table, double=True)
            start = _turned(scene.sling, start, scene.turned)
            options = {"payload": scene.payload}
            motion = move(bench, scene.sling, theta, scene.steps, start, **options, **TIGHT)
            band = ReferenceRod(scene.sling, theta, **options)
            expected = march(band, scene.steps, start, friction=2 * sample[3])
            size, pull = np.abs(expected.x - start).max(), np.abs(expected.force).max()
            states.append(np.abs(motion.x[0] - expected.x).max() / size)
            forces.append(np.abs(motion.force[0] - expected.force).max() / max(pull, 1e-9))
        result[name] = (float(np.max(states)), float(np.max(forces)))
    return result


def checks(
    bench: Bench, count: int = 4, sling: ClampedBand | None = None, **others: float
) -> list[Measure]:
    against = "NumPy reference implementation, Newton's method to rounding"
    note = f"{count} random θ of the box, double precision"
    result = []
    differences = compare(bench, random_thetas(bench, count), sling, **others)
    for name, (states, forces) in differences.items():
        result.append(
            Measure(f"states of a band {name}", against, states, "of its motion", LIMIT, note)
        )
        if forces > 0:
            result.append(
                Measure(f"force of a band {name}", against, forces, "of its peak", LIMIT, note)
            )
    return result


def section(bench: Bench) -> Theme:
    return Theme(
        "The kernel against a reference implementation",
        checks(bench),
        "`validation/simulator/reference.py` is the rod written a second time, in plain NumPy from"
        " its equations. Both take the same steps in double precision.",
    )
