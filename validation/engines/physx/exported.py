"""An exported stage in PhysX: hung in its clamps, drawn, held, and launched.

The stage is opened as it is; what it leaves to its user is done as its README says: the nodes are
written where the band hangs, those in the clamps and in the hand are led.
"""

from __future__ import annotations

import ast
import json
import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pipeline.base.errors import UserError
from pipeline.base.minimum_jerk import minimum_jerk
from pipeline.export.mesh import Tube
from pipeline.export.replay import Shot
from pipeline.export.usd import RATE, UsdBand
from pipeline.simulator.cylinder import volumes
from pipeline.simulator.launch import Launches
from pipeline.simulator.model import ClampedBand, LaunchSetup
from pipeline.simulator.rubber import NEO_HOOKEAN
from validation.engines.physx.bands import Engine
from validation.engines.physx.flight import Flight, led_to
from validation.engines.physx.law import force_on, gradients

HANG, PULL, HOLD = 1.0, 2.0, 1.0  # s
FALLS = 0.02  # m, at most, in the step in which a bent stage is opened


@dataclass(frozen=True)
class Steps:
    """How a band is hung, drawn and held.

    Attributes:
        rate: Steps a second.
        times: That it hangs, is drawn, and is held [s].
    """

    rate: int = RATE
    times: tuple[float, float, float] = (HANG, PULL, HOLD)


def read(folder: Path) -> tuple[str, UsdBand]:
    """The stage of an export, and the band that it says. Raises UserError where it is none."""
    try:
        name = json.loads((folder / "card.json").read_text("utf-8"))["band"]
        text = (folder / f"{name}.usda").read_text(encoding="utf-8")
        places = json.loads((folder / "nodes.json").read_text("utf-8"))["hanging_m"]
        rest = np.array(_value(text, "point3f[] omniphysics:restShapePoints"), float)
        tetrahedra = np.array(_value(text, "int4[] tetVertexIndices"), int)
        mass = _value(text, "float omniphysics:mass")
        young = _value(text, "float omniphysics:youngsModulus")
        poisson = _value(text, "float omniphysics:poissonsRatio")
        friction = _value(text, "float omniphysics:dynamicFriction")
        if np.shape(places) != rest.shape:
            raise ValueError("nodes.json is of another stage")
    except (OSError, ValueError, KeyError, TypeError, SyntaxError) as error:
        raise UserError(f"{folder}: {error}; `sling export --to usd` writes it") from error
    count = int(np.isclose(rest[:, 0], rest[0, 0]).sum())
    rest, hanging = (np.reshape(points, (-1, count, 3)) for points in (rest, places))
    share = np.repeat(volumes(rest, tetrahedra) / 4, 4)
    weight = np.bincount(tetrahedra.ravel(), share)
    tube = Tube(rest, tetrahedra, mass * weight / weight.sum(), hanging, hanging, np.zeros(0))
    return text, UsdBand(tube, young, poisson, friction)


def _value(text: str, name: str):
    """What a property of the stage is set to. Raises ValueError."""
    match = re.search(rf"^\s*(?:uniform )?{re.escape(name)} = (.+)$", text, re.MULTILINE)
    if not match:
        raise ValueError(f"the stage has no {name}")
    return ast.literal_eval(match[1].strip())


def job_of(band: UsdBand, places: np.ndarray, offsets: np.ndarray, steps: Steps) -> dict:
    """What worker.py is to do: hang N bands, and lead their middles to `places` (N, 3) [m].

    Args:
        offsets: Where the bands' origins stand [m], shape (N, 3).
    """
    flat = band.tube.clamped.reshape(-1, 3)
    hang, pull, hold = (round(time * steps.rate) for time in steps.times)
    part = minimum_jerk(np.arange(1, pull + hold + 1) / pull)
    begin = flat[band.hand].mean(axis=0)
    path = begin + part[:, None, None] * (places - begin)
    led = led_to(band.tube, path.reshape(-1, 3))
    return {
        "step": 1 / steps.rate,
        "phases": 2,
        "offsets": offsets,
        "rest": band.tube.rest.reshape(-1, 3),
        "start": np.tile(flat, (len(places), 1, 1)),
        "vertices_0": band.ends,
        "targets_0": flat[band.ends][None],
        "fade_0": np.zeros(hang),
        "keep_0": np.zeros(hang, bool),
        "vertices_1": np.concatenate([band.ends, band.hand]),
        "targets_1": led.reshape(*path.shape[:2], -1, 3),
        "fade_1": 1 - part,
        "keep_1": np.arange(pull + hold) == pull + hold - 1,
    }


def held(
    engine: Engine, text: str, band: UsdBand, place: np.ndarray, steps: Steps = Steps(), *,
    opens: np.ndarray | None = None,
) -> tuple[float, float]:  # fmt: skip
    """A stage's band with its middle led to `place` (3,) and held there.

    Args:
        opens: Where its nodes are as the stage opens (sections, V, 3) [m]; None: at rest.

    Returns:
        Force on the hand by the stress of PhysX's law in the tetrahedra that it reaches, which
        without damping is all [N]; and the mean volume of those between the clamps, of that at
        rest.
    """
    tube = band.tube
    job = job_of(band, place[None], np.zeros((1, 3)), steps)
    if opens is not None:
        job |= {"rest": opens.reshape(-1, 3), "as_written": FALLS}
    done = engine.run(text, job)
    last = done["positions_1"][-1, 0].reshape(tube.rest.shape).astype(float)
    force = force_on(tube, [tube.middle], last, band.young, band.poisson)
    free = tube.tetrahedra[~np.isin(tube.tetrahedra, band.ends).any(axis=1)]
    volume = np.linalg.det(gradients(tube, free, last)[1]).mean()
    return float(np.linalg.norm(force)), float(volume)


def launched(
    engine: Engine, text: str, band: UsdBand, sling: ClampedBand, setup: LaunchSetup, places,
    *, offsets: np.ndarray | None = None, youngs: np.ndarray | None = None, steps: Steps = Steps(),
) -> list[Shot]:  # fmt: skip
    """Launches from where the hand rests, `places` (N, 2) [m], by a stage of N bands.

    Args:
        offsets: Where they stand [m], shape (N, 3); None: all at the origin, as for one.
        youngs: Young's modulus of each [Pa], shape (N,); None: the band's.
    """
    count = len(places)
    thetas = np.tile([band.young, band.poisson, 0.0, band.friction, 1.0], (count, 1))
    if youngs is not None:
        thetas[:, 0] = youngs
    rigid = replace(setup, arm_stiffness=None, history=None)
    plain = replace(sling, law=NEO_HOOKEAN)
    flight = Flight(plain, rigid, band.tube, thetas, places, steps.rate)
    where = np.column_stack([np.zeros(count), places])
    job = job_of(band, where, np.zeros((count, 3)) if offsets is None else offsets, steps)
    shape = (count, *band.tube.rest.shape)
    engine.run(text, job, lambda flat: flight(flat.reshape(shape).astype(float)))
    return shots_of(flight.outcome().launches)


def shots_of(done: Launches) -> list[Shot]:
    """Launches one by one."""
    rows = zip(done.landing_y, done.speed, done.angle, done.hold_force, strict=True)
    return [Shot(*map(float, row)) for row in rows]


def yielded(draws: np.ndarray, force: np.ndarray, stiffness: float | None) -> np.ndarray:
    """Where the middle rests (N, 2) when an arm of a stiffness [N/m] is sent to draws (N, 2)."""
    length = np.linalg.norm(draws, axis=1, keepdims=True)
    given_way = np.asarray(force)[:, None] / stiffness if stiffness else 0.0
    return draws * (1 - given_way / length)
