"""Random parameter vectors of the whole box: a rollout is finite, or says why it is not."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from pipeline import bench as yardstick
from pipeline.sling import THETA, Sling, interact, launch
from pipeline.verify.agreement import random_thetas
from pipeline.verify.check import Bench, Check, Section
from pipeline.verify.experiment import band_of

COUNT, LAUNCHES, BATCH, SEED = 10_000, 2_000, 500, 1
HELD_FAST = 1e5  # N: at this force of the pads no band slips out
UNCONVERGED = "the simulation did not converge"
ALLOWED = 10  # of 10,000 that did not converge, each marked so


def survey(bench: Bench, sling: Sling, thetas: np.ndarray, progress=print) -> dict:
    """Roll all thetas out, batch by batch, and count what comes of them."""
    episode = yardstick.pull_and_release("band", bench.params.episode, sling)
    reasons, bad, farthest, failed = Counter(), 0, 0.0, []
    for first in range(0, len(thetas), BATCH):
        part = thetas[first : first + BATCH]
        done = interact(sling, episode, part, device=bench.device, workers=bench.workers)
        good = np.array([reason is None for reason in done.failure])
        reasons.update(reason for reason in done.failure if reason is not None)
        lines, force = done.center_line[good], done.force[good]
        bad += int(np.sum(~np.isfinite(lines).all((1, 2, 3)) | ~np.isfinite(force).all((1, 2))))
        farthest = max(farthest, float(np.linalg.norm(lines, axis=3).max(initial=0)))
        failed += [
            dict(zip(THETA, map(float, part[k]), strict=True))
            for k in np.flatnonzero(~good)
            if done.failure[k] == UNCONVERGED
        ]
        if first // BATCH % 4 == 3:
            progress(f"  {first + len(part)}/{len(thetas)} rollouts, {dict(reasons)}")
    return {
        "rollouts": len(thetas),
        "reasons": dict(reasons),
        "unconverged": failed,
        "not_finite": bad,
        "farthest_node_m": farthest,
    }


def survey_launches(bench: Bench, sling: Sling, thetas: np.ndarray) -> dict:
    """Launch with all thetas from random draws of the arm's box, and count what comes of them."""
    rng, setup = np.random.default_rng(SEED), bench.params.setup
    draws = np.column_stack(
        [rng.uniform(*box, len(thetas)) for box in (setup.draw_y, setup.draw_z)]
    )
    done = launch(sling, thetas, draws, device=bench.device, workers=bench.workers)
    good = np.array([reason is None for reason in done.failure])
    outcome = np.column_stack([done.landing_y, done.speed, done.angle, done.hold_force])
    return {
        "launches": len(thetas),
        "reasons": dict(Counter(reason for reason in done.failure if reason is not None)),
        "not_finite": int(np.sum(~np.isfinite(outcome[good]).all(1))),
    }


def section(bench: Bench, count: int = COUNT, launches: int = LAUNCHES, progress=print) -> Section:
    sling, thetas = band_of(bench), random_thetas(bench, count, SEED)
    held = survey(bench, replace(sling, grip_force=HELD_FAST), thetas, progress)
    gripped = survey(bench, sling, thetas[:launches], progress)
    launched = survey_launches(bench, sling, thetas[:launches])
    surveys = {"held_fast": held, "default_grip": gripped, "launches": launched}
    slipped = sum(gripped["reasons"].values()) - len(gripped["unconverged"])
    allowed = ALLOWED * count / COUNT

    def told(reasons: dict) -> str:
        return "; ".join(f"{number} “{reason}”" for reason, number in reasons.items()) or "none"

    checks = [
        Check(
            f"not finite, though not marked failed, of {count} rollouts, {launches} with the"
            f" default grip and {launches} launches",
            "0",
            float(sum(one["not_finite"] for one in surveys.values())),
            "θ",
            0.0,
            f"farthest node {held['farthest_node_m']:.2f} m from the fork",
        ),
        Check(
            f"unconverged, and marked so, of {count} rollouts held fast",
            "0, or marked failed with a reason",
            float(len(held["unconverged"])),
            "θ",
            allowed,
            told(held["reasons"]),
        ),
        Check(
            f"failed of {launches} with the default grip",
            "—",
            float(sum(gripped["reasons"].values())),
            "θ",
            None,
            f"{slipped} of them slip out of the fingers; {told(gripped['reasons'])}",
        ),
        Check(
            f"failed of {launches} launches from random draws",
            "—",
            float(sum(launched["reasons"].values())),
            "θ",
            None,
            told(launched["reasons"]),
        ),
    ]
    return Section(
        "Random parameters",
        checks,
        "θ from the whole box of `params.yaml`, on the pull-and-release of `sling bench`; a rollout"
        " that fails carries its reason and counts for nothing.",
        details={"seed": SEED, "surveys": surveys},
    )
