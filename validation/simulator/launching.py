"""Launches: converged in steps and mesh, ballistic, and never richer than the drawn band."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp

from sling2sim2real.simulator import ClampedBand, Launches, Parameters, launch
from sling2sim2real.simulator.initial import drawn_guess
from sling2sim2real.simulator.launch import schedule_of
from sling2sim2real.simulator.model import GRAVITY, LaunchHistory
from sling2sim2real.simulator.records import Grip
from sling2sim2real.simulator.schedule import relaxation
from validation.simulator.experiment import band_of, rest, setup_of
from validation.simulator.finding import Bench, Measure, Theme, off
from validation.simulator.reference import ReferenceRod

COUNT, SEED, REFINE = 20, 3, 10
RANGES = {  # of what a launch depends on: friction belongs to the pads, which a launch has not
    "youngs_modulus": (1e5, 1e6),
    "poissons_ratio": (0.30, 0.49),
    "elasticity_damping": (3e-4, 1.6e-2),
    "damping_scale": (0.0, 1.0),
}
DRAW_Y, DRAW_Z = (-0.45, -0.30), (-0.30, -0.10)
LIMIT = 0.5  # % of the speed
REFINED, REFERENCE = (1, 2, 4, 8), 32  # times finer steps, for the order in time
SHORT_OF_2 = 0.2  # an order of 1.8 is taken for second order


def random_launches(count: int = COUNT) -> tuple[np.ndarray, np.ndarray]:
    """Thetas (count, 5), those with several decades on a log scale, and draws (count, 2)."""
    rng = np.random.default_rng(SEED)

    def uniform(low: float, high: float, log: bool = False) -> np.ndarray:
        if log:
            return np.exp(rng.uniform(np.log(low), np.log(high), count))
        return rng.uniform(low, high, count)

    theta = np.column_stack(
        [
            uniform(*RANGES["youngs_modulus"], log=True),
            uniform(*RANGES["poissons_ratio"]),
            uniform(*RANGES["elasticity_damping"], log=True),
            np.full(count, 0.5),
            uniform(*RANGES["damping_scale"]),
        ]
    )
    draws = np.column_stack([uniform(*DRAW_Y), uniform(*DRAW_Z)])
    return theta, draws


def with_edges(sling: ClampedBand, times: int) -> ClampedBand:
    """The band on a mesh of `times` as many edges."""
    finer = sling.steps.model_copy(update={"edges": times * sling.edges})
    return replace(sling, edges=finer.edges, steps=finer)


def differences(default: Launches, finer: Launches) -> dict[str, float]:
    """What the default is off from the finer one at most [%]; a failure of either is no number."""
    return {
        name: off(getattr(default, name), getattr(finer, name))
        for name in ("speed", "landing_y", "hold_force")
    }


def convergence(
    bench: Bench,
    count: int = COUNT,
    sling: ClampedBand | None = None,
    history: LaunchHistory | None = None,
    **others: float,
) -> list[Measure]:
    sling, (thetas, draws) = sling or band_of(bench), random_launches(count)
    setup = setup_of(bench, history=history)
    thetas = Parameters.of(sling.law, thetas, **others)
    default = launch(sling, setup, thetas, draws, **bench.on)
    steps, mesh = f"{REFINE} times finer steps", "a mesh 2 times finer"
    finer = {
        steps: (sling, REFINE),
        mesh: (with_edges(sling, 2), 1),
        f"{steps} and {mesh}": (with_edges(sling, 2), REFINE),
    }
    checks = []
    for name, (band, refine) in finer.items():
        # on the CPU: so fine a band in double precision does not fit a GPU's shared memory
        options = {"double": True, "workers": bench.workers, "refine": refine}
        far = differences(default, launch(band, setup, thetas, draws, **options))
        checks.append(Measure(
            f"launch speed, worst of {count} random θ", name, far["speed"], "%", LIMIT,
            f"landing {far['landing_y']:.2f} %, hold force {far['hold_force']:.2f} %",
        ))  # fmt: skip
    return checks


def order_in_time(bench: Bench, count: int = COUNT) -> list[Measure]:
    """Observed order of each launch's speed, from the default steps to the finest of REFINED."""
    sling, setup, (thetas, draws) = band_of(bench), setup_of(bench), random_launches(count)
    parameters = Parameters.of(sling.law, thetas)

    def speed(refine: int) -> np.ndarray:
        return launch(sling, setup, parameters, draws, double=True, refine=refine, **bench.on).speed

    finest = speed(REFERENCE)
    errors = np.array([np.abs(speed(refine) / finest - 1) for refine in REFINED])
    lowest = (np.log(errors[0] / errors[-1]) / np.log(REFINED[-1] / REFINED[0])).min()
    worst = 100 * errors.max(axis=1)
    orders = np.log2(worst[:-1] / worst[1:])
    return [
        Measure(
            f"order of the launch speed in time, what it is short of 2 at worst of {count}",
            f"{REFERENCE} times finer steps, double precision",
            float(np.maximum(2 - lowest, 0.0)),
            "",
            SHORT_OF_2,
            f"lowest order {lowest:.2f} of any launch from steps of the default to 1/8 of it; at"
            f" 1, 1/2, 1/4, 1/8 the worst is {', '.join(f'{error:.2g}' for error in worst)} % off,"
            f" orders {', '.join(f'{order:.2f}' for order in orders)}",
        )
    ]


def _flight(y: float, z: float, speed: float, angle: float, floor: float) -> float:
    """Where a free point mass meets the floor, integrated numerically."""

    def landed(_, state: np.ndarray) -> float:
        return state[1] - floor

    landed.terminal = True
    start = [y, z, speed * np.cos(angle), speed * np.sin(angle)]
    path = solve_ivp(
        lambda _, state: [*state[2:], 0.0, -GRAVITY],
        (0.0, 5.0), start, events=landed, rtol=1e-10, atol=1e-12,
    )  # fmt: skip
    return float(path.y_events[0][0][0])


def physics(bench: Bench, count: int = COUNT) -> list[Measure]:
    """Ballistic flight, and the energy that the drawn band holds."""
    sling, setup, (thetas, draws) = band_of(bench), setup_of(bench), random_launches(count)
    parameters = Parameters.of(sling.law, thetas)
    done = launch(sling, setup, parameters, draws, **bench.on)
    state = zip(done.separation_y, done.separation_z, done.speed, done.angle, strict=True)
    flights = [_flight(*row, -setup.fork_height) for row in state]
    shares = []
    for k, draw in enumerate(draws):
        theta = parameters[[k]]
        table = relaxation(Grip.POUCH)
        table["target"] = 0.0, *draw
        drawn = rest(
            bench, sling, theta, drawn_guess(sling, draw[None])[0], table=table, double=True
        )
        rod = ReferenceRod(sling, theta)
        lift = setup.projectile_mass * GRAVITY * (done.separation_z[k] - draw[1])
        gained = setup.projectile_mass / 2 * done.speed[k] ** 2 + lift
        shares.append(gained / rod.elastic(drawn))
    named = sum(reason is not None for reason in done.failure)
    return [
        Measure(
            "landing",
            "flight from where it leaves the pouch, integrated apart",
            off(done.landing_y, flights),
            "%",
            1e-4,
            f"{count} random θ and draws; {named} failed",
        ),
        Measure(
            "energy of the projectile",
            "elastic energy of the drawn band",
            float(100 * np.max(shares)),
            "% of it",
            100.0,
            f"{100 * np.min(shares):.0f}–{100 * np.max(shares):.0f} %, by damping",
        ),
    ]


def section(bench: Bench) -> Theme:
    setup, edges = setup_of(bench), band_of(bench).edges
    size = setup.step
    count = len(schedule_of(setup).steps)
    return Theme(
        "Launches",
        [*convergence(bench), *order_in_time(bench), *physics(bench)],
        f"Random θ (E 0.1–1 MPa, ν 0.30–0.49, d 0.3–16 ms, s 0–1) and draws. The default takes"
        f" {1e3 * size:g} ms steps of second order on {edges} edges, in single precision;"
        f" at most {count} steps, until the projectile leaves.",
    )
