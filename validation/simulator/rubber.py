"""The law `rubber`: Biderman's string, softening, relaxation, flow, energy, steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.simulator.initial import drawn_guess
from sling2sim2real.simulator.model import ClampedBand, LaunchHistory
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.records import Grip
from sling2sim2real.simulator.rubber import RUBBER
from sling2sim2real.simulator.schedule import steps
from validation.simulator import agreement, damping, energy, launching, robustness
from validation.simulator.closed import (
    flow_integral,
    integral,
    left_of,
    stress,
)
from validation.simulator.experiment import (
    TIGHT,
    band_of,
    move,
    settling,
    setup_of,
    straight,
    straight_guess,
)
from validation.simulator.finding import Bench, Measure, Theme, off

SHAPES = (-0.3, 0.2), (0.3, 0.0), (0.9, 0.05)  # Mooney's share and the upturn
BOX = {
    "mooney_share": (-0.3, 0.9),
    "upturn": (0.0, 0.3),
    "softening": (0.0, 0.6),
    "relaxation": (0.0, 0.1),
    "flow": (0.0, 0.6),
    "log_flow_rate": (0.0, 5.0),
}
RELAXATION, SOFTENING = 0.04, 0.3
FLOW, LOG_FLOW_RATE = 0.25, 2.5
SHAPE = 0.3, 0.1
PULL_LIMIT, INTEGRAL_LIMIT = 0.1, 2.0  # percent
THIN = 40  # times thinner than the band: no beam any more
FULL = 0.4999  # Poisson's ratio of a volume that hardly changes
FORMULAS = ((1, "recoil_step"),)  # of the steps that never gain energy
HISTORY = LaunchHistory(pull_time=4.0, pause=2.0)
SEED = 5


def rubber_of(bench: Bench) -> ClampedBand:
    return replace(band_of(bench), law=RUBBER)


def law_parameters(
    shape: tuple[float, float] = SHAPE,
    relaxation: float = RELAXATION,
    softening: float = SOFTENING,
    flow: float = FLOW,
    log_flow_rate: float = LOG_FLOW_RATE,
) -> dict[str, float]:
    """Parameters that the law has of its own."""
    return dict(zip(BOX, (*shape, softening, relaxation, flow, log_flow_rate), strict=True))


def _string(bench: Bench, lighter: float = 1.0) -> ClampedBand:
    """A straight, thin, light band at its rest length, to be drawn across at its middle."""
    sling = rubber_of(bench)
    sling = replace(sling, radius=sling.radius / THIN, mass=sling.mass / THIN**2 / lighter)
    return straight(sling, sling.rest_length)


def drawn_across(
    bench: Bench, sling: ClampedBand, stretch: np.ndarray, times: np.ndarray, **law_values: float
) -> tuple[np.ndarray, np.ndarray]:
    """Pull along the band [N] over A mu as its middle is drawn to stretches (T,), and the times."""
    young = 1e6
    theta = Parameters.of(RUBBER, [young, FULL, 2e-4, 0.5, 1.0], **law_values)
    depth = sling.rest_length / 2 * np.sqrt(np.maximum(stretch**2 - 1, 0))
    table = steps(times, np.diff(times)[0], grip=Grip.POUCH)
    table["target"][:, 1] = -depth[1:]
    motion = move(bench, sling, theta, table, straight_guess(sling), gravity=0.0, double=True)
    half = np.hypot(depth[1:], sling.half_width)
    pull = motion.force[0, :, 1] * half / depth[1:].clip(1e-9) / 2
    return pull / (sling.area * young / (2 * (1 + FULL))), table["time"]


def pull(bench: Bench, stretches=(1.2, 1.6, 2.2), shapes=SHAPES) -> list[Measure]:
    """Check the pull at rest, drawn so slowly that branches with weight 0 do nothing."""
    worst = 0.0
    for shape in shapes:
        sling = _string(bench)
        for stretch in stretches:
            path = np.append(np.linspace(1.001, stretch, 40), [stretch] * 20)
            alone = law_parameters(shape, 0.0, flow=0.0)
            got, _ = drawn_across(bench, sling, path, 10.0 * np.arange(len(path)), **alone)
            worst = max(worst, off(got[-1], stress(stretch, shape)))
    return [
        Measure(
            f"pull of a thin string to stretch {max(stretches):g}, worst of shares and upturns"
            f" {', '.join(f'{share:g}, {upturn:g}' for share, upturn in shapes)}",
            "Biderman in uniaxial stress, P = μ (λ − λ⁻²)(1 − m + m/λ + c (I₁ − 3))",
            worst,
            "%",
            PULL_LIMIT,
            f"{THIN} times thinner than the band, ν {FULL}",
        )
    ]


def cycle(bench: Bench, most: float = 1.8, softening: float = SOFTENING) -> list[Measure]:
    """Drawn to a stretch, led back, drawn beyond it: no rate, so that softening alone is seen."""
    sling, shape = _string(bench), SHAPE
    turns = np.array([1.001, most, 1.3, most + 0.2])
    path = np.concatenate([np.linspace(a, b, 120) for a, b in zip(turns, turns[1:], strict=False)])
    times = 10.0 * np.arange(len(path))
    alone = law_parameters(shape, 0.0, softening, flow=0.0)
    got, _ = drawn_across(bench, sling, path, times, **alone)
    path, worst = path[1:], np.maximum.accumulate(path)[1:]
    left = [left_of(*pair, shape, softening) for pair in zip(path, worst, strict=True)]
    summary, taut = stress(path, shape) * left, path > 1.05
    return [
        Measure(
            f"stress of a slow cycle to stretch {most:g}, back, to {most + 0.2:g}, worst moment",
            "Ogden and Roxburgh's pseudo-elastic softening, by integrated works",
            float(100 * np.abs(got - summary)[taut].max() / summary.max()),
            "% of its peak",
            PULL_LIMIT,
            f"softening {softening:g}: {100 * (1 - min(left)):.0f} % less on the way back",
        )
    ]


def relaxation(bench: Bench, shape=SHAPE, most: float = 1.6) -> list[Measure]:
    """A step of 0.2 s held for 3 s, and a loop out and back in 1 s."""

    def expected(history: Callable, times: np.ndarray) -> np.ndarray:
        return np.array([integral(history, time, shape, RELAXATION) for time in times])

    alone = law_parameters(shape, softening=0.0, flow=0.0)
    against = "hereditary integral of the nominal stress"
    return _of_histories(
        bench, most, alone, expected, against, f"{100 * RELAXATION:g} % relax in a decade"
    )


def flow(bench: Bench, shape=SHAPE, most: float = 1.6) -> list[Measure]:
    """The same histories of a band that flows."""

    def expected(history: Callable, times: np.ndarray) -> np.ndarray:
        return flow_integral(history, times, shape, FLOW, 10**LOG_FLOW_RATE)

    alone, against = law_parameters(shape, 0.0, 0.0), "o' = p' − r |o/E|³ o, by LSODA"
    note = f"flow {FLOW:g}, r = 10^{LOG_FLOW_RATE:g}/s"
    return _of_histories(bench, most, alone, expected, against, note)


def _of_histories(
    bench: Bench,
    most: float,
    alone: dict[str, float],
    expected: Callable[[Callable, np.ndarray], np.ndarray],
    against: str,
    note: str,
) -> list[Measure]:
    """A string of parameters `alone`, beside what the stress over its modulus should be."""
    ramp, turn = 0.2, 0.5
    histories = {
        "held after a step": (lambda t: 1 + (most - 1) * np.clip(t / ramp, 0, 1), 3.0, ramp),
        "out and back": (lambda t: 1 + (most - 1) * (1 - abs(t / turn - 1)), 2 * turn, 0.05),
    }
    checks = []
    for name, (history, end, first) in histories.items():
        times = np.append(np.linspace(0, 0.25, 251), np.linspace(0.252, end, 400))
        stretch = np.maximum(history(times), 1.0)
        got, at = drawn_across(bench, _string(bench, 10.0), stretch, times, **alone)
        chosen = np.flatnonzero((at > first) & (stretch[1:] > 1.05))[::40]
        summary = expected(history, at[chosen])
        worst = 100 * np.abs(got[chosen] - summary).max() / summary.max()
        checks.append(Measure(
            f"stress {name}, to {100 * (most - 1):.0f} % strain, worst moment", against,
            float(worst), "% of its peak", INTEGRAL_LIMIT,
            f"share and upturn {alone['mooney_share']:g}, {alone['upturn']:g}; {note}",
        ))  # fmt: skip
    return checks


def growth(bench: Bench, count: int = 16) -> list[Measure]:
    """Elastic, kinetic and the branches' energy after random states, relaxed there, are let go."""
    points = random_points(bench, count)
    return damping.growth(bench, rubber_of(bench), points, FORMULAS, **TIGHT)


def slack(bench: Bench) -> list[Measure]:
    """A band that relaxed while drawn and is led back to its rest length pushes the hand no more.

    It is longer than it was; it bends out and grows short again.
    """
    sling = rubber_of(bench)
    theta = Parameters.of(RUBBER, [3e5, 0.45, 1e-3, 0.5, 0.5], **law_parameters(relaxation=0.1))
    sling = straight(sling, sling.rest_length)
    out, back = np.linspace(0.01, 1, 100), 30 + np.linspace(0.005, 0.5, 100)
    later = np.linspace(1.1, 30, 40), 30.5 + np.linspace(0.05, 60, 200)
    times = np.concatenate([[0], out, later[0], back, later[1]])
    depth = 0.3 * np.interp(times, [0, 1, 30, 30.5, 91], [0, 1, 1, 0, 0])
    table = steps(times, 0.01, grip=Grip.POUCH)
    table["target"][:, 1] = -depth[1:]
    motion = move(bench, sling, theta, table, straight_guess(sling), double=True)
    force = np.linalg.norm(motion.force[0], axis=1)
    weight = sling.mass * 9.81
    return [
        Measure(
            "force on the hand a minute after a drawn band was led back, over the band's weight",
            "at most its weight: nothing is stretched",
            float(force[-1] / weight) if not motion.failed[0] else float("nan"),
            "weights",
            1.0,
            f"{force[: len(table)].max():.1f} N at its most",
        )
    ]


def histories(bench: Bench, theta=(3e5, 0.45, 2e-3, 0.5, 0.7)) -> list[Measure]:
    """`launch` starts with what a pull and a pause leave in the memory: the march of that pull."""
    sling, draw = rubber_of(bench), np.array([-0.35, -0.15])
    theta = Parameters.of(RUBBER, theta, **law_parameters())
    setup = setup_of(bench, history=HISTORY)
    done = launching.launch(sling, setup, theta, draw, device=bench.device)
    none = launching.launch(sling, setup_of(bench), theta, draw, device=bench.device)
    times = 0.02 * np.arange(301)  # 4 s, and 2 s drawn
    part = np.minimum(times / HISTORY.pull_time, 1)
    way = (part**2 * (3 - 2 * part))[:, None] * draw
    taut = np.hypot(sling.half_width, np.linalg.norm(way, axis=1)) > 1.001 * sling.rest_length / 2
    first = np.flatnonzero(taut)[0]  # until then a band remembers nothing
    table = steps(times[first:], 0.02, grip=Grip.POUCH)
    table["target"][:, 1:] = way[first + 1 :]
    before = settling(Grip.POUCH, (0.0, *way[first]))
    start = drawn_guess(sling, way[[first]])[0]
    motion = move(
        bench, sling, theta, np.concatenate([before, table]), start,
        payload=setup.projectile_mass, unrelaxed=1.0,  # what its weight stretches, it just did
    )  # fmt: skip
    hold = float(np.linalg.norm(motion.force[0, -1]))
    return [
        Measure(
            "hold force of a launch with a history",
            "a simulated pull of 4 s and a pause of 2 s to that draw",
            off(done.hold_force[0], hold),
            "%",
            0.5,
            f"{done.hold_force[0]:.3f} N; {none.hold_force[0]:.3f} N without memory",
        ),
    ]


def random_points(bench: Bench, count: int) -> Parameters:
    """Random points of the box in params.yaml, and of BOX for what the law adds."""
    box = SearchBox.of(bench.params.parameters, bounds=BOX, law=RUBBER)
    unit = np.random.default_rng(SEED).random((count, box.dimension))
    return box.parameters(box.to_physical(unit))


def survey(bench: Bench, count: int = robustness.COUNT) -> list[Measure]:
    sling = replace(rubber_of(bench), grip_force=robustness.HELD_FAST)
    surveyed = robustness.survey(bench, sling, random_points(bench, count))
    where = f"{count} random points, negative shares among them, held fast"
    return robustness.checks(surveyed, where, robustness.ALLOWED * count / robustness.COUNT)


def section(bench: Bench) -> Theme:
    sling = rubber_of(bench)
    balance = energy.balance(bench, sling=sling, **law_parameters())
    return Theme(
        "The law `rubber`",
        [
            *pull(bench),
            *cycle(bench),
            *relaxation(bench),
            *flow(bench),
            *agreement.checks(bench, 2, sling=sling, **law_parameters()),
            *energy.checks(balance),
            *growth(bench),
            *slack(bench),
            *histories(bench),
            *launching.convergence(bench, sling=sling, history=HISTORY, **law_parameters()),
            *survey(bench),
        ],
        "Mooney's share m, the upturn c, softening s, eight relaxing branches and one that flows"
        " beside the neo-Hookean material (simulator/rubber.h). E is the modulus after"
        " ten seconds, without flow."
        " Softening and each branch have a free energy; what they lose takes part in the balance.",
    )
