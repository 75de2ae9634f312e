"""Parameter vectors of the whole box and its boundary: rollouts are finite, or say why not."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.simulator import THETA, ClampedBand, Parameters, interact, launch
from sling2sim2real.simulator.parameters import EXTRA
from validation.simulator.agreement import random_thetas
from validation.simulator.experiment import band_of, setup_of
from validation.simulator.finding import Bench, Measure, Theme
from validation.synthetic import pull_and_release

COUNT, LAUNCHES, FACES, BATCH, SEED = 10_000, 2_000, 500, 500, 1
HELD_FAST = 1e5  # N: at this force of the pads no band slips out
UNCONVERGED = "the simulation did not converge"
ALLOWED = 10  # of 10,000 that did not converge, each marked so


@dataclass
class Survey:
    """What came of many simulations.

    Attributes:
        reasons: Of those that failed.
        unconverged: Parameters of those whose steps did not converge.
        not_finite: How many did not fail and hold a number that is none.
    """

    reasons: Counter = field(default_factory=Counter)
    unconverged: list[dict[str, float]] = field(default_factory=list)
    not_finite: int = 0

    def add(self, parameters: Parameters, failure: list[str | None], *numbers: np.ndarray) -> None:
        """Count N simulations: why each failed, and what each gave, of shapes (N, ...)."""
        self.reasons.update(reason for reason in failure if reason is not None)
        for number, reason in enumerate(failure):
            finite = all(np.isfinite(part[number]).all() for part in numbers)
            self.not_finite += reason is None and not finite
            if reason == UNCONVERGED:
                sample = parameters.sample(number)
                self.unconverged.append({k: v for k, v in sample.items() if k not in EXTRA})


def on_boundary(bench: Bench, faces: int) -> Parameters:
    """The 32 corners of the box, and `faces` random ones with one parameter at a bound."""
    corners = np.array(list(product((0.0, 1.0), repeat=len(THETA))))
    on_faces, turn = np.random.default_rng(SEED).random((faces, len(THETA))), np.arange(faces)
    on_faces[turn, turn % len(THETA)] = turn // len(THETA) % 2
    box = SearchBox.of(bench.params.parameters)
    return box.parameters(box.to_physical(np.concatenate([corners, on_faces])))


def survey(bench: Bench, sling: ClampedBand, parameters: Parameters) -> Survey:
    """Roll N parameters out; count what comes of them."""
    episode, surveyed = pull_and_release("band", bench.params.episode, sling), Survey()
    for first in range(0, len(parameters), BATCH):
        part = parameters[first : first + BATCH]
        done = interact(sling, episode, part, **bench.on)
        surveyed.add(part, done.failure, done.center_line, done.force)
    return surveyed


def survey_launches(bench: Bench, sling: ClampedBand, parameters: Parameters) -> Survey:
    """Launch with all from random draws of the arm's box, and count what comes of them."""
    rng, box, surveyed = np.random.default_rng(SEED), bench.params.setup, Survey()
    draws = np.column_stack(
        [rng.uniform(*ends, len(parameters)) for ends in (box.draw_y, box.draw_z)]
    )
    done = launch(sling, setup_of(bench), parameters, draws, **bench.on)
    outcome = done.landing_y, done.speed, done.angle, done.hold_force
    surveyed.add(parameters, done.failure, *outcome)
    return surveyed


def checks(surveyed: Survey, where: str, allowed: float = 0.0) -> list[Measure]:
    """No number may be none, and so many may not converge, each marked so."""
    notes = [f"{number} “{reason}”" for reason, number in surveyed.reasons.items()]
    for theta in surveyed.unconverged[:1]:
        notes.append("such as " + ", ".join(f"{name} {v:.3g}" for name, v in theta.items()))
    bad, unconverged = float(surveyed.not_finite), float(len(surveyed.unconverged))
    return [
        Measure(f"not finite, though not marked failed, of {where}", "0", bad, "θ", 0.0),
        Measure(
            f"unconverged, and marked so, of {where}", "0, or marked failed with a reason",
            unconverged, "θ", allowed, "; ".join(notes),
        ),
    ]  # fmt: skip


def section(
    bench: Bench, count: int = COUNT, launches: int = LAUNCHES, faces: int = FACES
) -> Theme:
    sling = band_of(bench)
    thetas = Parameters.of(sling.law, random_thetas(bench, count, SEED))
    fast, boundary = replace(sling, grip_force=HELD_FAST), on_boundary(bench, faces)
    within = f"{count} rollouts within the box, held fast"
    surveys = {
        within: survey(bench, fast, thetas),
        f"{len(boundary)} rollouts at its corners and on its faces, held fast": survey(
            bench, fast, boundary
        ),
        f"{launches} rollouts with the default grip": survey(bench, sling, thetas[:launches]),
        f"{launches} launches from random draws": survey_launches(bench, sling, thetas[:launches]),
    }
    allowed = {within: ALLOWED * count / COUNT}
    return Theme(
        "Random parameters",
        [
            check
            for name, done in surveys.items()
            for check in checks(done, name, allowed.get(name, 0.0))
        ],
        "θ from the box of `params.yaml`, on the pull-and-release of `sling bench`; a rollout that"
        " fails carries its reason and counts for nothing. Random θ lie within the box; what lies"
        " on its boundary is harder and counted apart.",
    )
