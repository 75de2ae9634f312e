"""Parameter vectors of the whole box and its boundary: rollouts are finite, or say why not."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import product

import numpy as np

from pipeline.identify.objective.box import SearchBox
from pipeline.simulator import THETA, ClampedBand, Parameters, interact, launch
from pipeline.simulator.parameters import EXTRA
from validation.simulator.agreement import random_thetas
from validation.simulator.experiment import band_of, setup_of
from validation.simulator.finding import Bench, Measure, Theme
from validation.synthetic import pull_and_release

COUNT, LAUNCHES, FACES, BATCH, SEED = 10_000, 2_000, 500, 500, 1
HELD_FAST = 1e5  # N: at this force of the pads no band slips out
UNCONVERGED = "the simulation did not converge"
ALLOWED = 10  # of 10,000 that did not converge, each marked so


def corners(bench: Bench) -> Parameters:
    """The 32 corners of the box, where each parameter is at a bound."""
    unit = np.array(list(product((0.0, 1.0), repeat=len(THETA))))
    box = SearchBox.of(bench.params.parameters)
    return box.parameters(box.to_physical(unit))


def on_faces(bench: Bench, count: int) -> Parameters:
    """`count` random ones of the box, one parameter of each at a bound, every one in turn."""
    unit = np.random.default_rng(SEED).random((count, len(THETA)))
    turn = np.arange(count)
    unit[turn, turn % len(THETA)] = turn // len(THETA) % 2
    box = SearchBox.of(bench.params.parameters)
    return box.parameters(box.to_physical(unit))


def ranges(thetas: list[dict[str, float]], names=THETA) -> str:
    """Between what bounds the parameters of thetas lie; one that all share is named as such."""

    def summary(name: str) -> str:
        low, high = (f"{f([theta[name] for theta in thetas]):.3g}" for f in (min, max))
        return f"{name} {low}" if low == high else f"{name} {low}–{high}"

    return ", ".join(summary(name) for name in names)


def survey(
    bench: Bench, sling: ClampedBand, parameters: Parameters, progress=print, batch: int = BATCH
) -> dict:
    """Roll N parameters out; count what comes of them."""
    episode = pull_and_release("band", bench.params.episode, sling)
    reasons, bad, farthest, failed = Counter(), 0, 0.0, []
    for first in range(0, len(parameters), batch):
        part = parameters[first : first + batch]
        done = interact(sling, episode, part, **bench.on)
        good = np.array([reason is None for reason in done.failure])
        reasons.update(reason for reason in done.failure if reason is not None)
        lines, force = done.center_line[good], done.force[good]
        bad += int(np.sum(~np.isfinite(lines).all((1, 2, 3)) | ~np.isfinite(force).all((1, 2))))
        farthest = max(farthest, float(np.linalg.norm(lines, axis=3).max(initial=0)))
        failed += [
            {name: value for name, value in part.sample(k).items() if name not in EXTRA}
            for k in np.flatnonzero(~good)
            if done.failure[k] == UNCONVERGED
        ]
        if first // batch % 4 == 3:
            progress(f"  {first + len(part)}/{len(parameters)} rollouts, {dict(reasons)}")
    return {
        "rollouts": len(parameters),
        "reasons": dict(reasons),
        "unconverged": failed,
        "not_finite": bad,
        "farthest_node_m": farthest,
    }


def survey_launches(bench: Bench, sling: ClampedBand, parameters: Parameters) -> dict:
    """Launch with all from random draws of the arm's box, and count what comes of them."""
    rng, box = np.random.default_rng(SEED), bench.params.setup
    draws = np.column_stack(
        [rng.uniform(*ends, len(parameters)) for ends in (box.draw_y, box.draw_z)]
    )
    done = launch(sling, setup_of(bench), parameters, draws, **bench.on)
    good = np.array([reason is None for reason in done.failure])
    outcome = np.column_stack([done.landing_y, done.speed, done.angle, done.hold_force])
    return {
        "launches": len(parameters),
        "reasons": dict(Counter(reason for reason in done.failure if reason is not None)),
        "not_finite": int(np.sum(~np.isfinite(outcome[good]).all(1))),
    }


def section(
    bench: Bench, count: int = COUNT, launches: int = LAUNCHES, faces: int = FACES, progress=print
) -> Theme:
    sling = band_of(bench)
    thetas = Parameters.of(sling.law, random_thetas(bench, count, SEED))
    fast = replace(sling, grip_force=HELD_FAST)
    held = survey(bench, fast, thetas, progress)
    edges = {
        "corners": survey(bench, fast, corners(bench), progress),
        "faces": survey(bench, fast, on_faces(bench, faces), progress),
    }
    gripped = survey(bench, sling, thetas[:launches], progress)
    launched = survey_launches(bench, sling, thetas[:launches])
    surveys = {"held_fast": held, "default_grip": gripped, "launches": launched} | edges
    allowed = ALLOWED * count / COUNT

    def summary(reasons: dict) -> str:
        return "; ".join(f"{number} “{reason}”" for reason, number in reasons.items()) or "none"

    def failed(name: str, counts: dict) -> Measure:
        total = float(sum(counts["reasons"].values()))
        return Measure(name, "—", total, "θ", None, summary(counts["reasons"]))

    boundary = [
        Measure(
            f"unconverged, and marked so, of {counts['rollouts']} rollouts {where}, held fast",
            "0",
            float(len(counts["unconverged"])),
            "θ",
            0.0,
            ranges(counts["unconverged"]) if counts["unconverged"] else "",
        )
        for where, counts in (
            ("at the corners of the box", edges["corners"]),
            ("on its faces, one parameter at a bound", edges["faces"]),
        )
    ]
    checks = [
        Measure(
            f"not finite, though not marked failed, of {count} rollouts, {len(corners(bench))} at"
            f" corners and {faces} on faces of the box, {launches} with the default grip and"
            f" {launches} launches",
            "0",
            float(sum(counts["not_finite"] for counts in surveys.values())),
            "θ",
            0.0,
            f"farthest node {held['farthest_node_m']:.2f} m from the fork",
        ),
        Measure(
            f"unconverged, and marked so, of {count} rollouts within the box, held fast",
            "0, or marked failed with a reason",
            float(len(held["unconverged"])),
            "θ",
            allowed,
            summary(held["reasons"]),
        ),
        *boundary,
        failed(f"failed of {launches} with the default grip", gripped),
        failed(f"failed of {launches} launches from random draws", launched),
    ]
    return Theme(
        "Random parameters",
        checks,
        "θ from the box of `params.yaml`, on the pull-and-release of `sling bench`; a rollout that"
        " fails carries its reason and counts for nothing. Random θ lie within the box; what lies"
        " on its boundary is harder and counted apart.",
        details={"seed": SEED, "surveys": surveys},
    )
