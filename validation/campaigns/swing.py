"""What the slack swing after a release does to the paper's loss: damping by mesh, and rounding.

    python -m validation.campaigns.swing

Tetrahedra move what the paper's method finds (deviations.py), and its searches end elsewhere on
another machine (machines.py). Here the geometric term is split by when its pictures were taken: in
the pull, while the band is let go and still taut, while it swings slack, and later. First with
other dampings in the paper's theta, in both meshes; its launches too. Then with theta off by less
than a float32 can tell. Thetas and episodes are those that a run has left under data/.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from pipeline.base import errors
from pipeline.base.files import write_json
from pipeline.base.layout import Layout
from pipeline.episode.episode import Episode
from pipeline.objective.loss import EpisodeLoss
from pipeline.params import load
from pipeline.sling.interaction import interact
from pipeline.sling.launch import launch
from pipeline.sling.load import sling_of_method
from pipeline.sling.model import Sling
from pipeline.sling.theta import at_points, calibrated, load_theta, point
from validation.benchmarks.timing import environment

REPORT = Path("reports/validation/swing.json")
OURS, PAPER, MESHES = "least_squares", "sling2sim2real", ("rod", "tetrahedra")
DAMPINGS = np.geomspace(2e-4, 1e-2, 35)  # s d [s]
PARTS = {  # s after the release
    "pull": (-np.inf, 0.0),
    "taut": (0.0, 0.05),  # until the band's middle passes the fork
    "swing": (0.05, 0.5),
    "later": (0.5, np.inf),
}
DRAWS = np.array([(-0.27, -0.20), (-0.30, -0.15), (-0.33, -0.17)])  # (y, z) [m]
D, S = 2, 4  # places of damping and its scale in theta
TINY, TIMES = 1e-7, 64  # relative change of a parameter; how often


class SplitPictures:
    """A band's first pull as simulated at points of a sling, beside the recorded one."""

    def __init__(self, params, episode: Episode, sling: Sling, points: np.ndarray) -> None:
        self.sling, theta = at_points(sling, points)
        rollouts = interact(self.sling, episode, theta)
        loss = EpisodeLoss.of(params, PAPER, episode, sling)
        self.total = loss.total(loss.terms(rollouts))
        after = episode.cloud_time - episode.release_time
        chosen = {
            name: loss.fitted_frames & (after > begin) & (after <= end)
            for name, (begin, end) in PARTS.items()
        }
        frames = 100 * loss.frames(rollouts)
        self.count = {name: int(one.sum()) for name, one in chosen.items()}
        self.mean = {name: frames[:, one].mean(axis=1) for name, one in chosen.items()}
        middle = rollouts.center_line[:, chosen["swing"], rollouts.center_line.shape[2] // 2]
        self.reach = middle[..., 1].max(axis=1)  # beyond the fork [m]


def by_mesh(params, band: str, episode: Episode) -> dict:
    """By mesh: the damping that each part's pictures would have, and landings.

    `sensitivity_cm` is the part's share in how far the geometric term moves over DAMPINGS;
    `reach_m` is how far beyond the fork a picture sees the middle of the band with theta as it is.
    """
    theta = point(load_theta(Layout().theta(band, PAPER), band))
    found, slings, best = {}, {}, {}
    for mesh in MESHES:
        section = params.sling.model_copy(update={"mesh": mesh})
        changed = params.model_copy(update={"sling": section})
        slings[mesh] = sling_of_method(changed, band, PAPER)
        dampings = np.append(DAMPINGS, theta[D] * theta[S])
        done = SplitPictures(params, episode, slings[mesh], _damped(theta, dampings))
        whole = sum(done.count.values())
        best[mesh] = dampings[np.argmin(done.total)]
        found[mesh] = {"loss": {"best_damping_s": best[mesh], "lowest": done.total.min()}} | {
            part: {
                "pictures": done.count[part],
                "best_damping_s": dampings[np.argmin(mean)],
                "sensitivity_cm": np.ptp(mean) * done.count[part] / whole,
            }
            for part, mean in done.mean.items()
        }
        found[mesh]["reach_m"] = float(done.reach[-1])
    landings = {
        f"{mesh}, best damping of {whose}": landed(slings[mesh], _damped(theta, [best[whose]]))
        for mesh in MESHES
        for whose in MESHES
    }
    return found | {"landing_m": {name: one[0].tolist() for name, one in landings.items()}}


def _damped(theta: np.ndarray, dampings) -> np.ndarray:
    """Theta with other products s d, shape (N, 5)."""
    thetas = np.tile(theta, (len(dampings), 1))
    thetas[:, D] = np.asarray(dampings) / theta[S]
    return thetas


def landed(sling: Sling, points: np.ndarray) -> np.ndarray:
    """Where DRAWS land with points (N, P) [m], shape (N, 3)."""
    each, every = np.repeat(points, len(DRAWS), axis=0), np.tile(DRAWS, (len(points), 1))
    return launch(*at_points(sling, each), every).landing_y.reshape(len(points), -1)


def by_rounding(params, band: str, method: str, episode: Episode) -> dict:
    """How far TINY changes of all parameters move the loss, each part and landings."""
    content = load_theta(Layout().theta(band, method), band)
    sling, best = calibrated(params, band, content), point(content)
    points = best * (1 + TINY * np.random.default_rng(0).standard_normal((TIMES, len(best))))
    done, landing = SplitPictures(params, episode, sling, points), landed(sling, points)
    return {
        "loss_range": np.ptp(done.total) / done.total.mean(),
        "range_cm": {part: np.ptp(mean) for part, mean in done.mean.items()},
        "landing_range": (np.ptp(landing, axis=0) / landing.mean(axis=0)).max(),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--report", type=Path, default=REPORT, help=f"(default: {REPORT})")
    args, params = parser.parse_args(), load()
    found = {}
    for band in params.run.bands:
        episode = Episode.load(Layout().episode(band))
        rounding = {method: by_rounding(params, band, method, episode) for method in (OURS, PAPER)}
        found[band] = {"meshes": by_mesh(params, band, episode), "rounding": rounding}
        print(f"{band} is done", flush=True)
    content = {
        "kind": "virtual",
        "asked": "Which pictures tell the paper's loss of damping, in either mesh, and which hang"
        " on rounding.",
        "settings": {
            "parts_s": {name: str(one) for name, one in PARTS.items()},
            "draws_m": DRAWS.tolist(),
            "relative_change": TINY,
            "changes": TIMES,
        },
        "bands": found,
    }
    write_json(args.report, content | environment("cpu", "python -m validation.campaigns.swing"))


if __name__ == "__main__":
    errors.run(main)
