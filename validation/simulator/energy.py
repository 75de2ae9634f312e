"""Where the hand's work goes: the balance of a pull, hold and release, step by step."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sling2sim2real.simulator.initial import hanging_guess
from sling2sim2real.simulator.interaction import schedule_of
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.records import Grip, Mode
from sling2sim2real.simulator.schedule import RELAX_STEPS
from validation.simulator.experiment import band_of, move
from validation.simulator.finding import Bench, Measure, Theme
from validation.simulator.reference import ReferenceRod
from validation.synthetic import pull_and_release

LIMIT = 1.0  # percent of the hand's work
THETA = (6e5, 0.45, 5e-3, 0.6, 0.8)


@dataclass(frozen=True)
class Balance:
    """Sums [J] since the band hung at rest, shape (S,) each, at `time` (S,).

    Attributes:
        hand: Work of the hand on the node that it leads.
        turning: Work of the fingers as they take and leave the direction of the middle.
        pads: Lost to the pads while they open.
        viscous: Lost to damping.
        branches: Free energy of the law `rubber`'s memory.
        relaxed: Lost as it forgets.
        softened: Lost as the band is stretched further than ever.
        integrator: Lost to the steps: what inertia and elastic forces do in a step is not quite
            the change of their energies.
    """

    time: np.ndarray
    hand: np.ndarray
    turning: np.ndarray
    elastic: np.ndarray
    kinetic: np.ndarray
    gravity: np.ndarray
    viscous: np.ndarray
    branches: np.ndarray
    relaxed: np.ndarray
    softened: np.ndarray
    pads: np.ndarray
    integrator: np.ndarray

    @property
    def remainder(self) -> np.ndarray:
        """What no entry explains: the residual of the steps, by the reference's forces."""
        return self.miss - self.integrator

    @property
    def miss(self) -> np.ndarray:
        """What the hand and the fingers put in, less what is stored and physically dissipated."""
        stored = self.elastic + self.branches + self.kinetic + self.gravity
        lost = self.viscous + self.relaxed + self.softened + self.pads
        return self.hand + self.turning - stored - lost

    def share(self, energy: np.ndarray) -> float:
        """Largest energy in percent of the hand's work at its largest."""
        return float(100 * np.abs(energy).max() / np.abs(self.hand).max())


@dataclass(frozen=True)
class Remembered:
    """Memory of the law `rubber` over steps (S,): what a step's forces need, and where energy is.

    Attributes:
        carried, following: As ReferenceRod has them, shape (S, E), (S, 1).
        worst: As ReferenceRod has it, as the steps begin, and after the last, shape (S + 1, E).
        free: Free energy of the branches at the steps' ends [J], shape (S,).
        lost: What they lose in each step, from the power at its ends [J], shape (S,).
    """

    carried: np.ndarray
    following: np.ndarray
    worst: np.ndarray
    free: np.ndarray
    lost: np.ndarray


def remembered(
    rod: ReferenceRod, table: np.ndarray, start: np.ndarray, x: np.ndarray
) -> Remembered:
    """Memory of states (S, L, 9) after steps from `start`, relaxed; steps at rest forget all."""
    columns = rod.columns(np.concatenate([start[None], x]))
    stress, done = rod.uniaxial(rod.stretch(columns)), rod.pulled(rod.stretch(columns))
    weights, carried = rod.branches, np.zeros((len(x), rod.sling.edges))
    overstress = np.zeros((len(x) + 1, rod.sling.edges, len(weights)))
    following = np.zeros((len(x), 1))
    moving = table["mode"] == Mode.MOVE
    worst = np.empty((len(x) + 1, rod.sling.edges))
    worst[0] = rod.worst
    for k, goes_on in enumerate(moving):
        worst[k + 1] = np.maximum(worst[k] if goes_on else rod.worst, done[k + 1])
    for k in np.flatnonzero(moving):
        forget, follow = rod.update(table[k], overstress[k])
        retained = forget * overstress[k]
        carried[k] = (retained - np.outer(stress[k], follow)) @ weights
        following[k] = follow @ weights
        overstress[k + 1] = retained + np.outer(stress[k + 1] - stress[k], follow)
    free, power = rod.remembered(overstress, columns)
    lost = np.where(moving, table["h"] * (power[1:] + power[:-1]) / 2, 0.0)
    return Remembered(carried, following, worst, free[1:], lost)


def balance(
    bench: Bench, theta=THETA, sling: ClampedBand | None = None, **others: float
) -> Balance:
    """The bench's pull and release in double precision, every step of it accounted for.

    `others` are parameters beside `theta` (5,).
    """
    sling = sling or band_of(bench)
    parameters = Parameters.of(sling.law, theta, **others)
    episode = pull_and_release("band", bench.params.episode, sling)
    table = schedule_of(sling, episode).steps
    motion = move(bench, sling, parameters, table, hanging_guess(sling), double=True)
    first = RELAX_STEPS - 1  # the band hangs
    rows = table[first + 1 :]
    x1, x = motion.x[0, first:-1], motion.x[0, first + 1 :]
    v1, v, at = motion.v[0, first:-1], motion.v[0, first + 1 :], motion.at[0, first + 1 :]
    v2 = np.concatenate([v1[:1], v1[:-1]])
    past, beta = (rows[name][:, None, None] for name in ("past", "beta"))
    moved = x - x1
    rod = ReferenceRod(sling, parameters)
    memory = remembered(rod, table, motion.start[0], motion.x[0])
    carried, following = memory.carried[first + 1 :], memory.following[first + 1 :]
    free, lost = memory.free[first + 1 :], memory.lost[first + 1 :]
    worst = memory.worst[first + 1 :]
    softened = rod.lost_for_ever(np.diff(worst, axis=0))

    goes_on = np.diff(table["grip"][first:]) == 0  # else forces jump as the step begins

    def work(force: np.ndarray) -> np.ndarray:
        """Work of forces (S, ...) at the steps' ends, in each step [J]: by the trapezoid."""
        before = np.where(goes_on[:, None, None], np.roll(force, 1, axis=0), force)
        return ((before + force) / 2 * moved).sum((-2, -1))

    elastic, before = np.empty(len(x)), np.empty(len(x))
    conservative, viscous = np.empty_like(x), np.empty_like(x)
    for gripped in (False, True):
        part = (rows["grip"] == Grip.HELD) == gripped
        band = replace(
            rod,
            gripped=gripped,
            carried=carried[part],
            following=following[part],
            worst=worst[:-1][part],
        )
        still = np.zeros_like(v[part])
        elastic[part], before[part] = band.elastic(x[part]), band.elastic(x1[part])
        conservative[part] = band.internal(x[part], still, at[part])
        viscous[part] = band.viscous(v[part], at[part])
    rate = (v - v1 - past * (v1 - v2)) / (beta * rows["h"][:, None, None])
    kinetic = np.append(0.0, rod.kinetic(v))
    integrator = work(rod.mass * rate + conservative) - np.diff(kinetic) - (elastic - before)
    integrator -= np.diff(free, prepend=0.0) + lost + softened
    led = np.zeros_like(x)
    led[:, sling.middle, :3] = -motion.force[0, first + 1 :]
    hand = work(led)
    hanging = rod.elastic(x1[0])
    turning = before - np.append(hanging, elastic[:-1])
    return Balance(
        time=rows["time"],
        hand=np.cumsum(np.where(rows["grip"] == Grip.HELD, hand, 0.0)),
        turning=np.cumsum(turning),
        elastic=elastic - hanging,
        kinetic=kinetic[1:],
        gravity=rod.weight(x) - rod.weight(x1[0]),
        viscous=np.cumsum(work(viscous)),
        branches=free,
        relaxed=np.cumsum(lost),
        softened=np.cumsum(softened),
        pads=-np.cumsum(np.where(rows["grip"] == Grip.OPENING, hand, 0.0)),
        integrator=np.cumsum(integrator),
    )


def checks(done: Balance) -> list[Measure]:
    parts = {
        name: getattr(done, name)[-1]
        for name in (
            "elastic", "branches", "kinetic", "gravity", "viscous", "relaxed", "softened", "pads",
        )
    }  # fmt: skip
    parts["steps"] = done.miss[-1]
    note = " + ".join(f"{name} {value:.4f}" for name, value in parts.items())
    against = (
        "hand + fingers' turning = elastic + branches + kinetic + gravity + dissipated (viscous,"
        " relaxed, softened, pads)"
    )
    return [
        Measure(
            "balance of energy, largest miss at any time",
            against,
            done.share(done.miss),
            "%",
            LIMIT,
            f"of the hand's work; the steps' own loss is the miss. At the end: hand"
            f" {done.hand[-1]:.4f} J and turning {done.turning[-1]:.4f} J = {note} J",
        ),
        Measure(
            "residual of the kernel's steps by the reference's forces",
            "balance with the steps' loss, by its formula, as an entry",
            done.share(done.remainder),
            "%",
            LIMIT,
            "of the hand's work, largest at any time: every step is solved, no force is missing",
        ),
    ]


def section(bench: Bench) -> Theme:
    done = balance(bench)
    return Theme(
        "Energy of a pull, hold and release",
        checks(done),
        "The yardstick of `sling bench`, in double precision, each step accounted for with the"
        " reference's energies and forces. What the hand puts in is stored or dissipated but for"
        " what the steps lose: what inertia and elastic forces do in a step, less the change of"
        " their energies.",
    )
