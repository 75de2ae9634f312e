"""Simulation-based calibration of the density: are its intervals true where its model is?

    python -m validation.campaigns.own_law
    python -m validation.campaigns.own_law --report-only   # of what is there

Coordinates and nuisances are drawn from the density's own priors, an episode of EPISODES by each
pull is simulated from them with the density's own noise, and identified by the default method: it
has no error of the model. Ranks of the truth are even, and 90 % intervals hold 90 %, where all is
right. Truths of which the pads lose the band, or the simulator fails, are drawn anew: no recording
shows them. Results are lines of results.jsonl in --work: a run that was killed goes on from there.
It writes reports/validation/density-own-law.json.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from pipeline.params import Params, load
from sling2sim2real.base import errors
from sling2sim2real.episode.episode import Episode
from sling2sim2real.episode.planned import planned_pull
from sling2sim2real.episode.signal import cutoff_hz
from sling2sim2real.identification.posterior.coordinates import Coordinates
from sling2sim2real.identification.posterior.likelihood import Failed, Likelihood, Tolerances
from sling2sim2real.identification.posterior.residuals import BINS, nearest
from sling2sim2real.settings.lab import Dip
from sling2sim2real.simulator.interaction import Rollouts, interact
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.replay import recorded_force
from validation.campaigns import runner
from validation.campaigns.runner import POSTERIOR
from validation.density import calibrated_by
from validation.projects import DEFAULTS
from validation.ranks import LEVEL, part_below, summary
from validation.reports import write_report
from validation.synthetic import visible

WORK, REPORT = Path(".checkpoints/own-law"), Path("reports/validation/density-own-law.json")
PULLS, EPISODES = ("informative", "paper"), 200
HELD = 0.85, 0.95  # of each coordinate's and of the landings' 90 % intervals
DRAW, PULL_TIME, PAUSE = (-0.40, 0.0), 4.0, 2.0
LAUNCHES = (-0.36, -0.30), (-0.18, -0.12)  # y and z of a launch, evenly between [m]
# As `correct_delays` leaves them, and the release of a force at 1 kHz [s].
CLOCKS = {
    "release_error": 2.8e-4,
    "delays": {
        "camera": {"left": 1e-4, "against": "pose"},
        "pose": {"left": 1.5e-4, "against": "release"},
    },
}
NOISE = 0.0006  # m of depth at 1 m
LANDED = 0.9  # share of the samples that must land


@dataclass(frozen=True)
class OwnLaw:
    """An episode, and the truth behind it.

    Attributes:
        sling, coordinates: Of the method.
        phi: True coordinates (D,).
        episode: As a recorder would have it.
    """

    sling: ClampedBand
    coordinates: Coordinates
    phi: np.ndarray
    episode: Episode


def sampled(params: Params, method: str, dips: Sequence[Dip], rng: np.random.Generator) -> OwnLaw:
    """A band of the first one's size, pulled with dips."""
    name, method_params = next(iter(params.bands)), params.methods[method]
    sling = ClampedBand.of(params.bands[name], params.setup, params.sling, law=method_params.law)
    coordinates = Coordinates.of_method(params, method, sling)
    hang = np.sqrt(max(sling.rest_length**2 / 4 - sling.half_width**2, 0.0))
    times = {"pull_time": PULL_TIME, "pause": PAUSE}
    plan = planned_pull(params.episode, name, -hang, DRAW, **times, dips=dips)
    late = rng.uniform(0, np.diff(plan.cloud_time)[0])
    plan = replace(
        plan, cloud_time=plan.cloud_time + late, metadata={"preprocessing": dict(CLOCKS)}
    )
    cutoff = cutoff_hz(params.force.cutoff, params.force.cutoff_unit)
    model = Likelihood(plan, sling, cutoff, method_params.fixed["dynamic_friction"])
    while True:
        phi = coordinates.quantiles(rng.random((1, len(coordinates.names))))[0]
        try:
            episode = _recorded(model, coordinates, phi, rng)
        except Failed:
            continue
        return OwnLaw(sling, coordinates, phi, episode)


def _recorded(
    model: Likelihood, coordinates: Coordinates, phi: np.ndarray, rng: np.random.Generator
) -> Episode:
    """What is recorded of a band with coordinates (D,). Raises Failed."""
    has, plan = model.tolerances, model.episode
    release, camera, hand = rng.normal(0, has.simulated)
    stamps = plan.cloud_time + camera + rng.normal(0, has.jitter, len(plan.cloud_time))
    true = replace(model.shifted(np.array([release, 0.0, hand])), cloud_time=np.sort(stamps))
    rollout = interact(model.sling, true, coordinates.parameters(phi[None]))
    if rollout.failure[0]:
        raise Failed(rollout.failure[0])
    force = recorded_force(rollout, plan, model.cutoff)[0]
    return replace(
        plan,
        force=_measured(force, plan.time, has, rng),
        clouds=_seen(rollout, model.sling, true, has, rng),
    )


def _measured(
    force: np.ndarray, time: np.ndarray, has: Tolerances, rng: np.random.Generator
) -> np.ndarray:
    """A force (T, 3) at times (T,) as the sensor has it."""
    bias, drift = rng.normal(0, [[has.bias], [has.drift]], (2, 3))
    since = (time - time[0]) / (time[-1] - time[0])
    late = rng.normal(0, has.pose) * np.gradient(force, time, axis=0)
    noise = rng.normal(0, has.force, force.shape)
    return (1 + rng.normal(0, has.gain)) * force + late + bias + np.outer(since, drift) + noise


def _seen(
    rollout: Rollouts, sling: ClampedBand, true: Episode, has: Tolerances, rng: np.random.Generator
) -> list[np.ndarray]:
    """Clouds of a rollout; each bin of the band in each picture is off by as much as it may be."""
    turn, shift = Rotation.from_rotvec(rng.normal(0, has.turn, 3)), rng.normal(0, has.shift, 3)
    lines, clouds = rollout.center_line[0], []
    place = np.append(0, np.cumsum(sling.edge_lengths)) / sling.rest_length
    held = lines[np.searchsorted(true.cloud_time, true.release_time) - 1, sling.middle]
    for time, line in zip(true.cloud_time, lines, strict=True):
        points = visible(line, sling.edge_lengths, sling.radius, true.camera, NOISE, rng)
        way = np.linalg.norm(line[sling.middle] - held) if time > true.release_time else 0.0
        _, edge, part = nearest(points.astype(float), line)
        at = place[edge] + part * np.diff(place)[edge]
        off = rng.normal(0, np.hypot(has.cloud, has.recoil * way), (BINS, 3))
        points = points + off[np.minimum((at * BINS).astype(int), BINS - 1)] - true.camera
        clouds.append((turn.apply(points) + true.camera + shift).astype(np.float32))
    return clouds


def ranked(params: Params, method: str, dips: Sequence[Dip], seed: Sequence[int]) -> dict:
    """What a method makes of an episode.

    Returns:
        "below": the share of the posterior's samples below the truth, by coordinate, and of a
        launch, whose draw is off as a hand's is; "truth" by coordinate; "settled"; "edges";
        "effective" samples; "pictures" of the recoil [s].
    """
    rng = np.random.default_rng(seed)
    virtual_band = sampled(params, method, dips, rng)
    outcome, confidence = calibrated_by(params, method, virtual_band.sling, [virtual_band.episode])
    names, samples = virtual_band.coordinates.names, outcome.samples
    assert samples is not None and outcome.coordinates is not None
    draw = np.array([rng.uniform(*LAUNCHES[0]), rng.uniform(*LAUNCHES[1])])
    off = rng.normal(0, params.trials.actuation_error, (len(samples) + 1, 2))
    truth = virtual_band.coordinates.parameters(virtual_band.phi[None])
    landed = outcome(draw + off[:1], truth).landing_y[0]
    landings = outcome(draw + off[1:], samples).landing_y
    below = part_below(outcome.coordinates, virtual_band.phi, rng.random())
    if np.isfinite(landed) and np.isfinite(landings).mean() > LANDED:
        launch = float(part_below(landings[np.isfinite(landings)], landed))
    else:
        launch = np.nan
    return {
        "below": dict(zip(names, below, strict=True)) | {"landing": launch},
        "truth": dict(zip(names, virtual_band.phi, strict=True)),
        "settled": confidence["settled"],
        "edges": confidence["edges"],
        "effective": confidence["effective_samples"],
        "pictures": confidence["recordings"][0]["pictures"],
    }


@dataclass(frozen=True)
class Drawn:
    """An episode of the density's own model."""

    pull: str
    number: int


def identified(job: Drawn) -> dict:
    params = load(DEFAULTS)
    dips = params.plan.dips if job.pull == "informative" else ()
    return ranked(params, POSTERIOR, dips, [19, PULLS.index(job.pull), job.number])


def figures(lines: list[dict]) -> dict:
    """Figures by pull: what the ranks of each coordinate and of the landings say."""
    result = {}
    for pull in PULLS:
        some = [line for line in lines if line["pull"] == pull]
        good = [line for line in some if "failed" not in line]
        if not good:
            continue
        parts = {
            name: np.array([line["below"][name] for line in good], float)
            for name in good[0]["below"]
        }
        said, unsaid = (
            [line["below"]["landing"] for line in good if line["settled"] == settled]
            for settled in (True, False)
        )
        ranks = {name: summary(part[np.isfinite(part)]) for name, part in parts.items()}
        result[pull] = {
            "episodes": len(good),
            "refused": [line["failed"] for line in some if "failed" in line],
            "settled": sum(line["settled"] for line in good),
            "ranks": ranks,
            "landing": {name: inside(of) for name, of in (("settled", said), ("not", unsaid))},
            "met": all(HELD[0] <= rank["coverage"] <= HELD[1] for rank in ranks.values()),
        }
    return result


def inside(parts: Sequence[float | None]) -> list[int]:
    """How many launches are inside their 90 % intervals, by their shares below, and of how many."""
    landed = np.asarray(parts, dtype=float)
    landed = landed[np.isfinite(landed)]
    return [int(np.sum(np.abs(landed - 0.5) <= LEVEL / 2)), len(landed)]


def main() -> None:
    parser = runner.parser(__doc__, REPORT, WORK)
    parser.add_argument("--episodes", type=int, default=EPISODES, help="of each pull, at most")
    args = parser.parse_args()
    todo = [Drawn(pull, number) for number in range(args.episodes) for pull in PULLS]
    lines = runner.results_of(args, identified, todo)
    content = {
        "kind": "virtual",
        "asked": "90 % intervals of each coordinate and of a launch hold 85 to 95 % of 200 truths"
        " that are drawn from the priors, with all nuisances.",
        "jobs": [len(lines), len(todo)],
        "figures": figures(lines),
        "episodes": lines,
    }
    for pull, pull_figures in write_report(args.report, content, digits=4)["figures"].items():
        print(f"{pull}: {pull_figures['episodes']} episodes, {pull_figures['settled']} settled")
        for name, rank in pull_figures["ranks"].items():
            print(f"  {name}: {rank}")


if __name__ == "__main__":
    errors.run(main)
