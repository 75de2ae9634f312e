"""What the slack swing after a release does to the paper's loss: damping by mesh, and rounding.

    python -m validation.campaigns.swing

Tetrahedra move what the paper's method finds (deviations.py), and its searches end elsewhere on
another machine (machines.py). Here the geometric term is split by when its pictures were taken: in
the pull, while the band is let go and still taut, while it swings slack, and later. First with
other dampings in the paper's theta, in both meshes. Then with theta off by about what a float32
rounds. Thetas and episodes are those that a run has left under data/. Last, launches in both
meshes of what deviations.json has found with each, in the same recording.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.base import errors
from pipeline.base.fingerprint import fingerprint
from pipeline.base.layout import Layout
from pipeline.episode.episode import Episode
from pipeline.identify.objective.loss import EpisodeLoss
from pipeline.identify.results.mounting import sling_of_method
from pipeline.identify.results.theta import calibrated, launch_setup, load_theta, parameters_of
from pipeline.params import Params, load
from pipeline.params.identification import parameter_names
from pipeline.simulator.interaction import interact
from pipeline.simulator.launch import launch
from pipeline.simulator.model import ClampedBand, LaunchSetup
from pipeline.simulator.parameters import THETA, Parameters
from pipeline.simulator.rubber import NEO_HOOKEAN
from validation.campaigns import runner
from validation.campaigns.runner import OURS, PAPER, read
from validation.effects import AS_IS
from validation.projects import with_section
from validation.reports import write_report

REPORT = Path("reports/validation/swing.json")
DEVIATIONS = Path("reports/validation/deviations.json")
MESHES, AS_TETRAHEDRA = ("rod", "tetrahedra"), "sling.mesh: tetrahedra"  # its switch
DAMPINGS = np.geomspace(2e-4, 1e-2, 35)  # s d [s]
PARTS = {  # begin and end, s after the release
    "pull": (-100.0, 0.0),
    "taut": (0.0, 0.05),  # until the band's middle passes the fork
    "swing": (0.05, 0.5),
    "later": (0.5, 100.0),
}
DRAWS = np.array([(-0.27, -0.20), (-0.30, -0.15), (-0.33, -0.17)])  # (y, z) [m]
D, S = "elasticity_damping", "damping_scale"
TINY, TIMES = 1e-7, 64  # relative change of a parameter; how often


class SplitPictures:
    """A band's first pull as simulated with some parameters, beside the recorded one."""

    def __init__(
        self, params: Params, episode: Episode, sling: ClampedBand, parameters: Parameters
    ) -> None:
        rollouts = interact(sling, episode, parameters)
        loss = EpisodeLoss.of(params, PAPER, episode, sling)
        self.total = loss.total(loss.terms(rollouts))
        after = episode.cloud_time - episode.release_time
        chosen = {
            name: loss.fitted_frames & (after > begin) & (after <= end)
            for name, (begin, end) in PARTS.items()
        }
        frames = 100 * loss.frames(rollouts)
        self.count = {name: int(mask.sum()) for name, mask in chosen.items()}
        self.mean = {name: frames[:, mask].mean(axis=1) for name, mask in chosen.items()}
        middle = rollouts.center_line[:, chosen["swing"], rollouts.center_line.shape[2] // 2]
        self.reach = middle[..., 1].max(axis=1)  # beyond the fork [m]


def by_mesh(params: Params, band: str, episode: Episode) -> dict:
    """Damping that each part's pictures would have, by mesh.

    `sensitivity_cm` is how far the part's pictures alone move the geometric term over DAMPINGS;
    `reach_m` is how far beyond the fork a picture sees the middle of the band with theta as it is.
    """
    theta, rows = parameters_of(load_theta(Layout().theta(band, PAPER), band)), {}
    damping = float(theta.column(D)[0] * theta.column(S)[0])
    dampings = np.append(DAMPINGS, damping)
    for mesh in MESHES:
        done = SplitPictures(
            params, episode, sling_with(params, band, mesh), _damped(theta, dampings)
        )
        whole = sum(done.count.values())
        best = dampings[np.argmin(done.total)]
        rows[mesh] = {
            "loss": {"best_damping_s": best, "lowest": done.total.min(), "own": done.total[-1]},
            "reach_m": float(done.reach[-1]),
        } | {
            part: {
                "pictures": done.count[part],
                "best_damping_s": dampings[np.argmin(mean)],
                "sensitivity_cm": np.ptp(mean) * done.count[part] / whole,
            }
            for part, mean in done.mean.items()
        }
    return {"own_damping_s": damping, "own_theta": theta.theta[0], **rows}


def sling_with(params: Params, band: str, mesh: str) -> ClampedBand:
    return sling_of_method(with_section(params, "sling", mesh=mesh), band, PAPER)


def as_found(params: Params, band: str, results: list[dict]) -> dict:
    """Launches in both meshes of what the paper's method found in one recording with each.

    `landing_ratio` is the mean over DRAWS, and `hold_force_ratio` too, beside rod and rod.
    """
    thetas = {
        result["switch"]: Parameters.of(NEO_HOOKEAN, result["point"][: len(THETA)])
        for result in results
        if (result["band"], result["method"], result["recording"], result["seed"])
        == (band, PAPER, 0, 1)
    }
    done, setup = {}, LaunchSetup.of(params.setup, params.sling)
    for mesh in MESHES:
        sling = sling_with(params, band, mesh)
        for whose, switch in zip(MESHES, (AS_IS, AS_TETRAHEDRA), strict=True):
            outcome = launch(sling, setup, thetas[switch], DRAWS)
            done[f"launched with {mesh}, found with {whose}"] = outcome
    first = next(iter(done.values()))
    return {
        name: {
            "landing_m": launches.landing_y,
            "landing_ratio": (launches.landing_y / first.landing_y).mean(),
            "hold_force_ratio": (launches.hold_force / first.hold_force).mean(),
        }
        for name, launches in done.items()
    }


def _damped(theta: Parameters, dampings) -> Parameters:
    """One sample with N other products s d."""
    return theta.changed(**{D: np.asarray(dampings) / theta.column(S)[0]})


def landed(sling: ClampedBand, setup: LaunchSetup, parameters: Parameters) -> np.ndarray:
    """Where DRAWS land with N parameters [m], shape (N, 3)."""
    count = len(parameters)
    each = parameters[np.repeat(np.arange(count), len(DRAWS))]
    landing = launch(sling, setup, each, np.tile(DRAWS, (count, 1))).landing_y
    return landing.reshape(count, -1)


def by_rounding(params: Params, band: str, method: str, episode: Episode) -> dict:
    """How far TINY changes of all parameters move the loss, each part and landings."""
    content = load_theta(Layout().theta(band, method), band)
    sling, best = calibrated(params, band, content), parameters_of(content)
    names = parameter_names(best.law)
    tiny = 1 + TINY * np.random.default_rng(0).standard_normal((TIMES, len(names)))
    moved = {name: best.column(name) * by for name, by in zip(names, tiny.T, strict=True)}
    points = best.changed(**moved)
    done, landing = (
        SplitPictures(params, episode, sling, points),
        landed(sling, launch_setup(params, content), points),
    )
    return {
        "loss_range": np.ptp(done.total) / done.total.mean(),
        "range_cm": {part: np.ptp(mean) for part, mean in done.mean.items()},
        "landing_range": (np.ptp(landing, axis=0) / landing.mean(axis=0)).max(),
    }


def main() -> None:
    args, params = runner.parser(__doc__, REPORT).parse_args(), load()
    results, bands = read(DEVIATIONS)["results"], {}
    for band in params.run.bands:
        episode = Episode.load(Layout().episode(band))
        rounding = {method: by_rounding(params, band, method, episode) for method in (OURS, PAPER)}
        bands[band] = {
            "episode": fingerprint(*sorted(Layout().episode(band).glob("*.parquet"))),
            "meshes": by_mesh(params, band, episode),
            "rounding": rounding,
            "launches": as_found(params, band, results),
        }
        print(f"{band} is done", flush=True)
    content = {
        "kind": "virtual",
        "asked": "Which pictures tell the paper's loss of damping, in either mesh, and which hang"
        " on rounding.",
        "settings": {"parts_s": PARTS, "draws_m": DRAWS, "relative_change": TINY, "changes": TIMES},
        "bands": bands,
    }
    write_report(args.report, content)


if __name__ == "__main__":
    errors.run(main)
