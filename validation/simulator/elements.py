"""The rod and the tetrahedral mesh side by side: why the default is the default."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pipeline.simulator import (
    ClampedBand,
    Launches,
    LaunchSetup,
    Parameters,
    Rollouts,
    interact,
    launch,
)
from pipeline.simulator.initial import sections_of
from pipeline.simulator.interaction import schedule_of
from pipeline.simulator.model import GRAVITY, ROD, TETRAHEDRA
from pipeline.simulator.records import Grip
from pipeline.simulator.schedule import Schedule, statics
from pipeline.simulator.solver import Options, Slings, memory, run
from validation.benchmarks.timing import timed
from validation.reports import row
from validation.simulator.closed import String, clamped_beam
from validation.simulator.experiment import setup_of, straight
from validation.simulator.finding import Bench, Theme
from validation.simulator.launching import random_launches
from validation.synthetic import pull_and_release

COUNT = 16  # thetas, as many as a thread's lanes
DEPTHS = (0.40, 0.55)  # of draws [m]
POISSON = (0.30, 0.45, 0.49)
PLACES = np.linspace(0, 1, 101)  # along the band, where centre lines are compared
TEXT = """\
`sling.mesh: tetrahedra` takes a solid cylinder instead of the rod: cross-sections of a centre and \
a hexagon, three linear tetrahedra a prism, through the same solver, material, hand and steps. \
Clamps and hand hold whole cross-sections. (The paper's band of 55 cm has 1.5 cm in each clamp, \
which do not deform: 52 cm are meshed.)

Linear tetrahedra lock: they are too stiff in bending, the more so the closer ν is to 0.5. And a \
held cross-section keeps a slab's length of band from thinning, which adds to the pull. Twice as \
many cross-sections mend the latter, at twice the cost, but the former hardly, as long as each has \
one ring of vertices. So both elements say nearly the same of a taut band; a slack one hangs and \
swings as if it were stiffer. A measured `flexural_rigidity` does not apply to a solid mesh. \
Tetrahedra run on the CPU alone. Figures against the rod are medians over random θ where nothing \
else is said.
"""


@dataclass(frozen=True)
class Figures:
    """Figures of one element.

    Attributes:
        pull: Hold force of each draw over a string's.
        bending: Stiffness of a clamped beam over Euler-Bernoulli's, for each nu.
        rollouts, launches: COUNT random thetas, on the yardstick of `sling bench` and launched.
        rollout_seconds, launch_seconds: CPU time of one of them.
    """

    sling: ClampedBand
    pull: np.ndarray
    bending: np.ndarray
    rollouts: Rollouts
    rollout_seconds: float
    launches: Launches
    launch_seconds: float
    memory: int

    @property
    def lines(self) -> np.ndarray:
        """Centre lines at PLACES [m], shape (COUNT, K, places, 3)."""
        arc = self.sling.arc / self.sling.rest_length
        at = np.searchsorted(arc, PLACES).clip(1, len(arc) - 1)
        part = ((PLACES - arc[at - 1]) / (arc[at] - arc[at - 1]))[:, None]
        line = self.rollouts.center_line.astype(float)
        return (1 - part) * line[:, :, at - 1] + part * line[:, :, at]


def slings(params) -> dict[str, ClampedBand]:
    """The first band of params.yaml in either mesh, and in twice as many sections."""
    band = params.bands[next(iter(params.bands))]
    shapes = (params.sling.model_copy(update={"mesh": mesh}) for mesh in (ROD, TETRAHEDRA))
    made = (ClampedBand.of(band, params.setup, shape) for shape in shapes)
    # tetrahedra feel no cylinder's drag
    rod, solid = (replace(sling, air_density=0.0) for sling in made)
    finer = replace(solid, edges=2 * solid.edges)
    return {"rod": rod, "tetrahedra": solid, "tetrahedra, twice as many": finer}


def bending(sling: ClampedBand, poissons=POISSON) -> np.ndarray:
    """Stiffness of a light beam clamped at both ends over Euler-Bernoulli's; NaN if it fails."""
    beam = straight(sling, sling.rest_length, mass=sling.mass / 200)
    young = 1e7
    nodes = np.zeros((beam.sections, 3))
    nodes[:, 0] = beam.arc - beam.half_width
    table = statics(Grip.FREE)
    thetas = [[young, nu, 2e-3, 0.5, 1.0] for nu in poissons]
    done = run(
        beam,
        Schedule(table, first_free=len(table)),
        Slings.of(beam, Parameters.of(beam.law, thetas), sections_of(beam, nodes)),
        options=Options(double=True),
    )
    load = beam.mass * GRAVITY / beam.rest_length
    expected = clamped_beam(load, beam.rest_length, young * np.pi * beam.radius**4 / 4)
    ratio = expected / -done.state[:, beam.middle, 2]
    return np.where(done.lanes["outcome"] == 0, ratio, np.nan)


def pull(
    sling: ClampedBand, setup: LaunchSetup, depths=DEPTHS, poisson: float = 0.45
) -> np.ndarray:
    """Hold force of a weightless band drawn level with the tips, over that of two strings."""
    light, setup = replace(sling, mass=1e-4), replace(setup, projectile_mass=1e-6)
    theta = np.array([5e5, poisson, 2e-3, 0.5, 1.0])
    half = np.hypot(depths, light.half_width)
    tension = String.of(light, theta).force(2 * half / light.rest_length)
    draws = np.column_stack([-np.array(depths), np.zeros(len(depths))])
    return launch(light, setup, Parameters.of(light.law, theta), draws).hold_force / (
        2 * tension * depths / half
    )


def measure(bench: Bench, sling: ClampedBand, count: int = COUNT) -> Figures:
    band = next(iter(bench.params.bands))
    episode = pull_and_release(band, bench.params.episode, sling)
    setup, (thetas, draws) = setup_of(bench), random_launches(count)
    thetas = Parameters.of(sling.law, thetas)
    firm = replace(sling, grip_force=1e6)  # no theta slips out of it
    launch(sling, setup, thetas[:1], draws[:1])  # compiles
    rollouts, rollout_seconds, _ = timed(lambda: interact(firm, episode, thetas))
    launches, launch_seconds, _ = timed(lambda: launch(sling, setup, thetas, draws))
    frames = len(episode.cloud_time)
    return Figures(
        sling=sling,
        pull=pull(sling, setup),
        bending=bending(sling),
        rollouts=rollouts,
        rollout_seconds=rollout_seconds / count,
        launches=launches,
        launch_seconds=launch_seconds / count,
        memory=memory(sling, schedule_of(sling, episode), frames, Options()),
    )


def compare(figures: Figures, rod: Figures) -> dict[str, float]:
    """Differences of an element from the rod, by what and [unit]."""
    times, frames = rod.rollouts.times, rod.rollouts.cloud_time
    peaks = [
        np.linalg.norm(element.rollouts.force, axis=2).max(axis=1) for element in (figures, rod)
    ]
    gap = np.linalg.norm(figures.lines - rod.lines, axis=3)
    # the hand holds the band while there is a force
    first, last = times[np.linalg.norm(rod.rollouts.force[0], axis=1) > 0][[0, -1]]
    periods = {
        "hanging": frames < first,
        "in the hand": (frames > first) & (frames < last),
        "let go": frames > last,
    }
    result = {"peak force of the yardstick's pull [%]": 100 * np.median(peaks[0] / peaks[1] - 1)}
    for name, during in periods.items():
        result[f"centre line {name}, rms [mm]"] = 1e3 * np.sqrt(np.mean(gap[:, during] ** 2))
    speed = 100 * (figures.launches.speed / rod.launches.speed - 1)
    landing = 100 * (figures.launches.landing_y / rod.launches.landing_y - 1)
    return result | {
        "launch speed [%]": np.median(speed),
        "launch speed, worst [%]": speed[np.argmax(np.abs(speed))],
        "landing [%]": np.median(landing),
    }


def failures(figures: Figures) -> int:
    reasons = [*figures.rollouts.failure, *figures.launches.failure]
    return sum(reason is not None for reason in reasons)


def table(columns: dict[str, Figures]) -> str:
    """Markdown: a row a figure, a column an element."""
    rod = next(iter(columns.values()))
    far = [compare(column, rod) for column in columns.values()]
    slings = [column.sling for column in columns.values()]
    rows: list[tuple[str, list[str]]] = [
        ("edges along the band", [f"{sling.edges}" for sling in slings]),
        ("degrees of freedom", [f"{sling.sections * sling.dofs:,}" for sling in slings]),
    ]
    for index, depth in enumerate(DEPTHS):
        values = [f"{100 * (column.pull[index] - 1):+.2f} %" for column in columns.values()]
        rows.append((f"hold force of a {depth:.2f} m draw, against two strings", values))
    for index, nu in enumerate(POISSON):
        values = [f"× {column.bending[index]:.2f}" for column in columns.values()]
        rows.append((f"bending stiffness against Euler–Bernoulli, ν {nu:.2f}", values))
    for name in far[0]:
        what, _, unit = name.rstrip("]").partition(" [")
        sign = "" if unit == "mm" else "+"
        values = ["", *(f"{difference[name]:{sign}.2f} {unit}" for difference in far[1:])]
        rows.append((f"{what}, against the rod", values))
    seconds = [(column.rollout_seconds, column.launch_seconds) for column in columns.values()]
    rows += [
        ("CPU time of a rollout", [_milliseconds(s, seconds[0][0]) for s, _ in seconds]),
        ("CPU time of a launch", [_milliseconds(s, seconds[0][1]) for _, s in seconds]),
        (
            "memory of a rollout",
            [f"{column.memory / 2**20:.2f} MiB" for column in columns.values()],
        ),
        (
            f"failed of {len(rod.rollouts.failure)} rollouts and as many launches",
            [f"{failures(column)}" for column in columns.values()],
        ),
    ]
    head = ["| | " + " | ".join(columns) + " |", "|---|" + "---:|" * len(columns)]
    return "\n".join([*head, *(row(name, *cells) for name, cells in rows)])


def _milliseconds(seconds: float, of_rod: float) -> str:
    ratio = seconds / of_rod
    return f"{1e3 * seconds:.3g} ms" + (f" (× {ratio:.0f})" if ratio > 1.5 else "")


def section(bench: Bench) -> Theme:
    """Compare the rod with tetrahedra on the CPU, whatever the other checks run on."""
    columns = {name: measure(bench, sling) for name, sling in slings(bench.params).items()}
    return Theme("Rod and tetrahedra", [], TEXT + table(columns))
