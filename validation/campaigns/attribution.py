"""Why our method is closer: law, search and prior changed one at a time.

    python -m validation.campaigns.attribution --orange FOLDER
    python -m validation.campaigns.attribution --page      # the table of docs/paper.md

Recordings: of each rig band and of 16 once sealed rubbers by dips and by the paper's pull, and the
three of `orange` in FOLDER, which this project did not make. Each is recorded once, and identified
by every variant: by the paper's search with either law, by our density with either law, and by our
density with other priors or less trust in the recoil. Landings are scored as by
validation/campaigns/landings.py, with bands as units; of `orange`, whose landings are given, the
unit is a recording. Results are lines of results.jsonl in --work: a run that was killed goes on.
After a change of pulls or methods, give another --work.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from unittest import mock

import numpy as np

from pipeline.base import errors
from pipeline.base.errors import UserError
from pipeline.episode.episode import Episode
from pipeline.identify.posterior.likelihood import Tolerances, opening_time
from pipeline.identify.posterior.residuals import Rule
from pipeline.launching.trials.spread import landing_intervals
from pipeline.params import Params, load
from rig.oracle.world import World
from validation.campaigns import runner
from validation.campaigns.landings import SETS, together
from validation.campaigns.rig_scores import built, recorded, saved, scored, sling_of, summaries
from validation.campaigns.runner import OURS, PAPER, ResultLines, read
from validation.campaigns.variants import priors_of, with_variants
from validation.density import Calibrated, calibrated_by
from validation.marked import block_of, fill, row
from validation.orange import NAME as ORANGE
from validation.orange import landings, with_orange
from validation.projects import DEFAULTS
from validation.reports import plain, write_report
from validation.rubbers import SPENT, rubbers, with_rubbers

METHODS = {  # and the words of the table
    PAPER: "the paper's search, neo-Hookean",
    "search_rubber": "the paper's search, law `rubber`",
    "density_neo_hookean": "our density, neo-Hookean",
    OURS: "our density, law `rubber`: the default",
    "no_softening": "… without softening",
    "no_flow": "… without flow",
    "prior_half": "… priors half as wide",
    "prior_twice": "… priors twice as wide",
    "prior_loss_up": "… loss factor expected 40 % higher",
    "prior_loss_down": "… loss factor expected 40 % lower",
    "later_pictures": "… the recoil's pictures of 50 ms instead of 34",
    "recoil_trusted_half": "… a recoil's picture trusted half as much",
}
EARLIER = {"first_picture": "… the recoil's first picture alone"}  # before Rule.recoil was 34 ms
RECORDINGS = {"bands": 3, "sealed": 1}
BANDS = {"bands": SETS["bands"][:2], "sealed": (SPENT, tuple(rubbers(SPENT)))}  # seed, names
OF_ORANGE = "orange", "orange_2", "orange_3"
WORK, REPORT = Path("data/attribution"), Path("reports/validation/attribution.json")
PAGE = Path("docs/paper.md")
COLUMNS = {  # of the table
    ("bands", "informative"): "rig bands, informative",
    ("bands", "paper"): "rig bands, the paper's pull",
    ("sealed", "informative"): "once sealed, informative",
    ("sealed", "paper"): "once sealed, the paper's pull",
    ("orange", "paper"): "`orange`, the paper's pull",
}


@dataclass(frozen=True)
class BandRecording:
    """One recording of a band.

    Attributes:
        group: Of bands: "bands", "sealed" (once), or "orange".
        number: Of the recording; of `orange` its file's.
    """

    group: str
    band: str
    pull: str
    number: int

    @property
    def lab(self) -> Params:
        """What the rig's own processes read: without the variants."""
        if self.group == "orange":
            return with_orange(load(DEFAULTS))
        return with_rubbers(load(DEFAULTS), BANDS[self.group][0], self.number, self.pull)

    @property
    def params(self) -> Params:
        return with_variants(self.lab)

    def episode(self, work: Path, orange: Path | None) -> Path:
        """The folder of its episode and clamps, made where they are missing."""
        folder = work / "episodes" / self.group / self.pull / self.band / str(self.number)
        if self.group == "orange":
            raw = Path(orange or ".") / f"{OF_ORANGE[self.number]}.mcap"
            built(self.params, ORANGE, raw, folder)
        else:
            recorded(self.params, self.band, folder)
        return folder


@dataclass(frozen=True)
class VariantJob(BandRecording):
    """One variant's identification by a recording."""

    method: str

    @property
    def recording(self) -> BandRecording:
        return BandRecording(self.group, self.band, self.pull, self.number)


def recordings(orange: Path | None, pulls=("informative", "paper")) -> list[BandRecording]:
    rig_recordings = [
        BandRecording(group, band, pull, number)
        for group, most in RECORDINGS.items()
        for number in range(most)
        for pull in pulls
        for band in BANDS[group][1]
    ]
    count = len(OF_ORANGE) if orange else 0
    return [
        BandRecording("orange", ORANGE, "paper", number) for number in range(count)
    ] + rig_recordings


@contextmanager
def recoil_of(method: str) -> Iterator[None]:
    """Change what the recoil counts, as a method's name says: less trust, or later pictures too."""
    trusted, counted = Tolerances.of, Rule.pictures

    def doubled(episode: Episode) -> Tolerances:
        return replace(trusted(episode), way=2 * Tolerances.way)

    def later(rule: Rule, episode: Episode) -> np.ndarray:
        return counted(replace(rule, recoil=rule.latest), episode)

    changes = {
        "recoil_trusted_half": (Tolerances, "of", doubled),
        "later_pictures": (Rule, "pictures", later),
    }
    with mock.patch.object(*changes[method]) if method in changes else nullcontext():
        yield


def identified(job: VariantJob, work: Path, orange: Path | None) -> dict:
    """Scores of a variant by one recording."""
    folder = job.recording.episode(work, orange)
    params = job.params
    method = job.method if job.method in params.methods else OURS
    episode, sling = Episode.load(folder / "episode"), sling_of(params, job.band, method, folder)
    friction = params.methods[OURS].fixed["dynamic_friction"]
    sling = replace(sling, finger_opening_time=opening_time(episode, sling, friction))
    with priors_of(job.method), recoil_of(job.method):
        outcome, confidence = calibrated_by(params, method, sling, [episode])
    if job.group == "orange":
        scores = against_given(outcome, params, *landings(Path(orange or ".")))
    else:
        file = saved(job.lab, folder / job.method / "params.yaml")
        with World(job.band, file, workers=1) as world:
            scores = scored(outcome, params, world, seed=job.number)
    return {
        "scores": scores,
        "identified": outcome.identified,
        "settled": confidence.get("settled"),
    }


def against_given(
    outcome: Calibrated, params: Params, draws: np.ndarray, measured: np.ndarray
) -> dict:
    """The same scores of given landings [m] of draws (N, 2): errors are from what was predicted."""
    predicted = outcome(draws).landing_y
    low = high = np.full(len(draws), np.nan)
    if outcome.samples is not None:
        error = params.trials.actuation_error
        low, high = landing_intervals(outcome, draws, outcome.samples, error).T
    return {
        "error": measured / predicted - 1,
        "miss": measured - predicted,
        "low": low,
        "high": high,
        "inside": (measured >= low) & (measured <= high),
        "targets": measured,
    }


def figures(lines: list[dict]) -> dict:
    """Figures by group and pull: each method's `together`, and the mean errors of each band."""
    result: dict = {}
    for group, pull in COLUMNS:
        some = [line for line in lines if (line["group"], line["pull"]) == (group, pull)]
        for method in METHODS:
            successes = [line for line in some if line["method"] == method and "failed" not in line]
            if not successes:
                continue
            of_units = summaries(successes, "number" if group == "orange" else "band")
            result.setdefault(f"{group}, {pull}", {})[method] = {
                "together": together(of_units),
                "recordings": len(successes),
                "failed": sum(line["method"] == method for line in some) - len(successes),
                **{
                    figure: {name: of_unit[figure] for name, of_unit in of_units.items()}
                    for figure in ("mean_bias", "coverage")
                },
            }
    return plain(result, 4)


def block(content: dict) -> str:
    """What the page has between its marks."""
    there = {", ".join(key): words for key, words in COLUMNS.items()}
    there = {key: words for key, words in there.items() if key in content["figures"]}
    heads = [
        f"{words} ({len(next(iter(content['figures'][key].values()))['mean_bias'])})"
        for key, words in there.items()
    ]
    rows = [row("identified by", *heads), "|---|" + "---:|" * len(heads)]
    for method, words in (METHODS | EARLIER).items():
        figures_of = [content["figures"][key].get(method) for key in there]
        if any(figures_of):
            rows.append(row(words, *map(_cell, figures_of)))
    return block_of("attribution", rows)


def _cell(method_figures: dict | None) -> str:
    if method_figures is None:
        return "–"
    means = method_figures["together"]
    text = f"{100 * means['mean_size_of_bias']:.1f} %"
    if means["coverage"] is not None:
        inside, width = (100 * means[name] for name in ("coverage", "median_width"))
        text += f"; {inside:.0f} % in {width:.0f} %"
    return text


def expect_orange(work: Path, orange: Path | None) -> None:
    """Raises UserError where a report would leave out results that are there."""
    if orange is None and ResultLines(work / "results.jsonl").where(group="orange"):
        raise UserError(f"{work}: has results of `orange`, give --orange to report them too")


def main() -> None:
    args = runner.parser(__doc__, REPORT, WORK, page=PAGE, orange=True).parse_args()
    if args.page:
        return fill(PAGE, block(read(args.report)))
    expect_orange(args.work, args.orange)
    folders, every = {"work": args.work, "orange": args.orange}, recordings(args.orange)
    todo = [
        VariantJob(**asdict(recording), method=method) for recording in every for method in METHODS
    ]
    runner.prepare(args, partial(BandRecording.episode, **folders), every)
    lines = runner.results_of(args, partial(identified, **folders), todo)
    content = {
        "kind": "virtual",
        "jobs": [len(lines), len(todo)],
        "recordings_of_each_band": RECORDINGS,
        "pads": "open as fast as the recorded force fell, for every variant",
        "figures": figures(lines),
    }
    print(block(write_report(args.report, content, runner.orange_argument(args))))


if __name__ == "__main__":
    errors.run(main)
