"""What each departure from the paper changes by itself: E, predicted force, landings, loss.

    python -m validation.campaigns.deviations --orange FOLDER
    python -m validation.campaigns.deviations --page    # the report's table into docs/paper.md

One setting at a time is put as the paper has it, for the paper's method with several search seeds
and for ours. What they find in recordings of the rig, which took part in no choice, is aimed at the
targets of the trials, as a perfect policy would, and launched on the rig without errors. Of the
band `orange`, FOLDER has the recordings and the measured landings, which no fit sees. What trains
policies has a campaign of its own, policy_as_printed. Results are lines of results.jsonl in --work:
a run that was killed goes on from there.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from pipeline.base import errors
from pipeline.base.errors import UserError
from pipeline.base.files import write_json
from pipeline.episode.episode import Episode
from pipeline.identify.objective.loss import EpisodeLoss
from pipeline.launching.trials.stretch import recorded_stretch, stretch_of
from pipeline.params import Params, load
from pipeline.simulator.interaction import interact
from validation import orange
from validation.campaigns import runner
from validation.campaigns.rig_scores import aimed, calibrated_clamps, errors_on_the_rig, identified
from validation.campaigns.runner import OURS, PAPER, read
from validation.density import Calibrated
from validation.effects import AS_IS, effects, runs, table
from validation.marked import block_of, fill
from validation.paired import LEVEL
from validation.projects import with_section
from validation.reports import write_report

WORK, REPORT = Path("data/deviations"), Path("reports/validation/deviations.json")
PAGE, BLOCK = Path("docs/paper.md"), "departures"  # and the name of its block
METHODS = {PAPER: "paper's method", OURS: "ours"}  # heads of columns
FIRST, RECORDINGS, SEEDS = 1001, 3, 2  # rig seed; a band; search seeds of the paper's method
EPISODES_ANEW = "cloud.sampling: before_filters", "force.cutoff_unit: rad/s", "loss.chamfer: clouds"
SWITCHES = {  # section and values, as the paper has them
    AS_IS: ("method_defaults", {}),
    "mounting: false": ("method_defaults", {"mounting": False}),
    "cloud.sampling: before_filters": ("cloud", {"sampling": "before_filters"}),
    "loss.chamfer: clouds": ("loss", {"chamfer": "clouds"}),
    "force.cutoff_unit: rad/s": ("force", {"cutoff_unit": "rad/s"}),
    "sling.mesh: tetrahedra": ("sling", {"mesh": "tetrahedra"}),
}
MESH = [*SWITCHES][-1]
WORDS = {  # of a row of docs/paper.md
    AS_IS: "nothing: as by default, the cut-off as we read it (0.224 rad per sample)",
    "mounting: false": "clamps not calibrated: `mounting: false`",
    "cloud.sampling: before_filters": "farthest points first: `cloud.sampling: before_filters`",
    "loss.chamfer: clouds": "Chamfer distance of two clouds: `loss.chamfer: clouds`",
    "force.cutoff_unit: rad/s": "the cut-off as printed: `force.cutoff_unit: rad/s`",
    "sling.mesh: tetrahedra": "tetrahedra: `sling.mesh: tetrahedra`",
}


@dataclass(frozen=True)
class Case:
    """One identification."""

    band: str
    recording: int
    switch: str
    method: str
    seed: int

    def episode(self, work: Path, switch: str | None = None) -> Path:
        """Where its episode lies, or that of another setting, with the clamps."""
        return place(work, self.band, self.recording, switch or self.switch)


def cases_of(bands: list[str], recordings: int, seeds: int) -> list[Case]:
    """Every identification: ours has one start; tetrahedra, which are slow, one of each band."""
    return [
        Case(band, recording, switch, method, seed)
        for switch in SWITCHES
        for seed in range(1, seeds + 1)
        for recording in range(recordings)
        for band in bands
        for method in (PAPER, OURS)
        if (method == PAPER or seed == 1)
        and (switch != MESH or (method, recording, seed) == (PAPER, 0, 1))
    ]


def params_of(band: str, switch: str) -> Params:
    """params.yaml with one setting as the paper has it; for `orange`, with that band."""
    params = load()
    params = orange.with_orange(params) if band == orange.NAME else params
    section, values = SWITCHES[switch]
    if section == "method_defaults":
        methods = {
            name: method.model_copy(update=values) for name, method in params.methods.items()
        }
        return params.model_copy(update={"methods": methods})
    return with_section(params, section, **values)


def forces(band: str, outcome: Calibrated, episode: Episode) -> dict:
    """Peak and rms of the predicted force against the recorded one, and the default's loss."""
    params = params_of(band, AS_IS)
    sling, theta = outcome.sling, outcome.theta
    loss, rollouts = EpisodeLoss.of(params, PAPER, episode, sling), interact(sling, episode, theta)
    if rollouts.failure[0]:
        return {"rollout_failed": rollouts.failure[0]}
    held = (episode.time >= episode.grasp_time) & (episode.time <= episode.release_time)
    real, simulated = episode.force[held], loss.filtered(rollouts)[0][held]
    peaks = [np.linalg.norm(force, axis=1).max() for force in (real, simulated)]
    return {
        "peak_force": peaks[1] / peaks[0] - 1,
        "force_rms_n": np.sqrt(np.mean(np.sum((real - simulated) ** 2, axis=1))),
        "loss": loss.total(loss.terms(rollouts))[0],
    }


def misses(band: str, outcome: Calibrated, seen: Episode, recordings: Path | None) -> dict:
    """Errors of launches at the targets [m]; of `orange`, of predictions of measured launches."""
    params = params_of(band, AS_IS)
    if band != orange.NAME:
        return launches(band, params, aimed(outcome, params, params.trials.targets))
    draws, measured = orange.landings(recordings)
    error = np.abs(outcome(draws).landing_y / measured - 1)
    sizes = params.setup.fork_width, params.bands[band].rest_length
    stretch = stretch_of(np.insert(draws, 0, 0, axis=1), *sizes)
    inside = stretch <= recorded_stretch([seen], *sizes)
    return {"error": error, "miss": np.nanmean(error[inside]), "beyond": np.nanmean(error[~inside])}


def launches(band: str, params: Params, draws: np.ndarray) -> dict:
    """Where draws (T, 2) for the targets land on the rig, without errors."""
    error = errors_on_the_rig(band, params, draws)
    reached = np.isfinite(error).any()
    return {"error": error, "miss": np.nanmean(np.abs(error)) if reached else np.nan}


def place(work: Path, band: str, recording: int, switch: str) -> Path:
    number = 1 + EPISODES_ANEW.index(switch) if switch in EPISODES_ANEW else 0
    return work / "episodes" / f"{band}_{recording}" / str(number)


def prepare(where: tuple[str, int], work: Path, recordings: Path | None) -> None:
    """Make a recording's episodes with their clamps; where they are refused, with the default's."""
    band, number = where
    folders = {switch: place(work, band, number, switch) for switch in (AS_IS, *EPISODES_ANEW)}
    if all((folder / "mounting.json").exists() for folder in folders.values()):
        return
    from pipeline.recording.build import build_episodes  # both need Open3D, the rest does not
    from rig.recorder.record import record

    if band == orange.NAME:
        raw = recordings / (f"{band}_{number + 1}.mcap" if number else f"{band}.mcap")
    else:
        raw = folders[AS_IS].parent / f"{band}.mcap"
        raw.parent.mkdir(parents=True, exist_ok=True)
        record(with_section(params_of(band, AS_IS), "rig", seed=FIRST + number), band, raw)
    built = []
    for switch, folder in folders.items():
        params = params_of(band, switch)
        how = params.cloud, params.force
        episode = next((made for settings, made in built if settings == how), None)
        if episode is None:
            episode = build_episodes(raw, band, params)[0][0]
            built.append((how, episode))
        try:
            calibrated_clamps(params, band, episode, folder)
        except UserError as error:  # as printed, the low pass leaves no slack part
            clamps = read(folders[AS_IS] / "mounting.json")
            write_json(folder / "mounting.json", clamps | {"refused": str(error)})
    if band != orange.NAME:
        raw.unlink()


def scored(case: Case, work: Path, recordings: Path | None) -> dict:
    """What one identification found, and how near its forces and launches are."""
    params = params_of(case.band, case.switch)
    identification = identified(params, case.band, case.method, case.seed, case.episode(work))
    seen = Episode.load(case.episode(work, AS_IS) / "episode")
    return {
        "theta": identification.theta,
        "youngs_modulus": identification.theta["youngs_modulus"],
        "seconds": identification.seconds,
        "point": [*identification.outcome.identified.values()],
        "own_loss": identification.confidence.get("loss", {}).get("total"),
        **forces(case.band, identification.outcome, seen),
        **misses(case.band, identification.outcome, seen, recordings),
    }


def report(args: argparse.Namespace, cases: list[Case], results: list[dict]) -> None:
    """Write what the results in the work folder say."""
    params, rig = load(), [band for band in args.bands if band != orange.NAME]
    command = f"--workers {args.workers} --recordings {args.recordings} --seeds {args.seeds}"
    content = {
        "kind": "virtual",
        "asked": "What each departure from the paper changes by itself, in the paper's method and"
        " in ours; launches without errors, aimed as a perfect policy would.",
        "settings": {
            "switches": [*SWITCHES],
            "targets_m": params.trials.targets,
            "optimizer": params.optimizer.model_dump(),
            "recordings": args.recordings,
            "rig_seeds": [FIRST + number for number in range(args.recordings)],
            "search_seeds": {PAPER: args.seeds, OURS: 1},
            "intervals": f"{100 * LEVEL:.0f} %, bootstrap over bands, recordings and search seeds",
            "miss": "mean |landing - target| [m]; of orange, mean error of predicted landings as a"
            " share of the distance, within the recorded stretch",
            "clamps_refused": refused(args),
        },
        "cases": len(cases),
        "done": len(results),
        "figures": effects(results, [*SWITCHES], [PAPER, OURS], rig),
        "results": results,
    }
    write_report(args.report, content, f"{command} {runner.orange_argument(args)}")
    print(f"{args.report}: {len(results)} of {len(cases)} results", flush=True)
    print(block(content))


def block(content: dict) -> str:
    """What docs/paper.md has between its marks, of a report's content."""
    figures, settings = content["figures"], content["settings"]
    seeds, number = settings["search_seeds"], settings["recordings"]
    summary = [
        f"Recordings of each band: {number}. Search seeds: {seeds[PAPER]} of the paper's method,"
        " one of ours. Identifications:",
        *runs(figures, WORDS, METHODS),
    ]
    refusals: dict[str, list[str]] = {}
    for band, setting in (refusal.split(", ") for refusal in settings["clamps_refused"]):
        refusals.setdefault(setting, []).append(band)
    summary += [
        f"With `{setting}` no clamps can be calibrated ({', '.join(bands)}): the default's serve."
        for setting, bands in refusals.items()
    ]
    return block_of(BLOCK, [*table(figures, WORDS, METHODS), "", " ".join(summary)])


def refused(args: argparse.Namespace) -> dict:
    """Why a recording's clamps were not calibrated under a setting, so that others' were taken."""
    summary = {}
    for band in args.bands:
        for switch in EPISODES_ANEW:
            path = place(args.work, band, 0, switch) / "mounting.json"
            reason = read(path).get("refused") if path.exists() else None
            summary |= {f"{band}, {switch}": reason} if reason else {}
    return summary


def main() -> None:
    parser = runner.parser(__doc__, REPORT, WORK, page=PAGE, orange=True)
    parser.add_argument("--bands", nargs="+", default=list(load().run.rig), help="of the rig")
    parser.add_argument("--recordings", type=int, default=RECORDINGS, help="a band (default: 3)")
    parser.add_argument("--seeds", type=int, default=SEEDS, help="of searches (default: 2)")
    args = parser.parse_args()
    if args.page:
        return fill(PAGE, block(read(args.report)))
    args.bands += [orange.NAME] * (args.orange is not None)
    cases = cases_of(args.bands, args.recordings, args.seeds)
    recordings = [*dict.fromkeys((case.band, case.recording) for case in cases)]
    folders = {"work": args.work, "recordings": args.orange}
    runner.prepare(args, partial(prepare, **folders), recordings)
    report(args, cases, runner.results_of(args, partial(scored, **folders), cases))


if __name__ == "__main__":
    errors.run(main)
