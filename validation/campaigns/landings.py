"""Landings by each pull: how near and how sure, on rubbers to develop on, sealed ones, our bands.

    python -m validation.campaigns.landings develop
    python -m validation.campaigns.landings sealed     # once: validation/rubbers.py has the rules
    python -m validation.campaigns.landings bands

Each band is recorded by the paper's pull and by the informative one (`plan.dips`), the rig's bands
by the latter alone, and identified by the default method from that one recording; nine targets are
scored without launch noise (bias), and one launch each with it (coverage). The first recording of
each other band is also identified by the paper's method, and by ours with a launch measured.
Results are lines of results.jsonl in --work: a run that was killed, or whose --minutes were over,
goes on from there. It writes reports/validation/landings-<set>.json.
"""

from __future__ import annotations

import fcntl
import re
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from pipeline.params import Params, load
from rig.oracle.world import World
from sling2sim2real.base import errors
from sling2sim2real.base.errors import UserError
from sling2sim2real.identification.posterior.launches import Observed
from validation.campaigns import runner
from validation.campaigns.rig_scores import (
    TARGETS,
    aimed,
    recorded,
    saved,
    scored,
    sling_of,
    summaries,
)
from validation.campaigns.runner import PAPER, POSTERIOR, job_of
from validation.density import Calibrated, calibrated_by
from validation.projects import DEFAULTS
from validation.reports import paragraph, plain, row, write_report
from validation.rubbers import DEVELOP, RECORDINGS, SEALED, rubbers, with_rubbers

WORK, PULLS = Path(".checkpoints/landings"), ("informative", "paper")
OTHERWISE: tuple[tuple[str, dict], ...] = (  # how the first recording of a band is identified too
    ("informative", {"launched": True}),
    ("informative", {"method": PAPER}),
    ("paper", {"method": PAPER}),
)
COMPARED, FIRST = ("informative, virgin", "paper, virgin"), "first recordings"
STORED = "parameters", "derived", "settled", "edges", "steps"  # what is stored of a confidence
BANDS = "band1", "band2", "band3"
FRESH = range(200, 220)  # recordings of the rig's bands that no choice was made by
BOOTSTRAP = 2000


@dataclass(frozen=True)
class OneRecording:
    """A recording of a band, and how it is identified.

    Attributes:
        method: Of params.yaml.
        launched: Whether one launch at the middle target was measured.
    """

    seed: int
    band: str
    pull: str
    number: int
    method: str = POSTERIOR
    launched: bool = False

    @property
    def kind(self) -> str:
        """What the figures take together: all recordings of all bands."""
        parts = [self.pull, "virgin", *(["the paper's method"] if self.method == PAPER else [])]
        return ", ".join([*parts, *(["one launch"] if self.launched else [])])

    @property
    def params(self) -> Params:
        return with_rubbers(load(DEFAULTS), self.seed, self.number, self.pull)


SETS = {
    "develop": (DEVELOP, tuple(rubbers(DEVELOP)), range(RECORDINGS), PULLS),
    "sealed": (SEALED, tuple(rubbers(SEALED)), range(RECORDINGS), PULLS),
    "bands": (DEVELOP, BANDS, FRESH, PULLS[:1]),
}


def jobs(name: str, most: int = len(FRESH)) -> list[OneRecording]:
    """List at most so many recordings of each band of a set by each pull."""
    seed, bands, numbers, pulls = SETS[name]
    recorded = [
        OneRecording(seed, band, pull, number)
        for pull in pulls
        for number in numbers[:most]
        for band in bands
    ]
    otherwise = [
        OneRecording(seed, band, pull, 0, **otherwise)
        for pull, otherwise in OTHERWISE
        for band in bands
        if 0 in numbers
    ]
    return recorded + otherwise


def identified(job: OneRecording, work: Path) -> dict:
    """Scores of a method by one recording, and what it says of itself."""
    params, begin = job.params, time.process_time()
    folder = work / f"{job.seed}-{job.band}-{job.pull}-{job.number}"
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "lock").open("w") as lock:  # one records, others of the same recording wait
        fcntl.flock(lock, fcntl.LOCK_EX)
        episode = recorded(params, job.band, folder)
    sling, start = sling_of(params, job.band, job.method, folder), time.process_time()
    outcome, confidence = calibrated_by(params, job.method, sling, [episode])
    with World(job.band, saved(params, folder / "params.yaml"), workers=1) as world:
        if job.launched:
            observed = measured(outcome, params, world, job.number)
            outcome, confidence = calibrated_by(params, job.method, sling, [episode], observed)
        seconds = time.process_time() - start
        scores = scored(outcome, params, world, seed=job.number)
    return {
        "scores": scores,
        "confidence": {name: confidence.get(name) for name in STORED},
        "delays": episode.metadata["preprocessing"].get("delays"),
        "identification_s": seconds,
        "cpu_s": time.process_time() - begin,
    }


def measured(outcome: Calibrated, params: Params, world: World, number: int) -> list[Observed]:
    """One launch at the middle target with errors of its own, as a lab would make it."""
    draws = aimed(outcome, params)[[len(TARGETS) // 2]]
    landing = world.trials(draws, [5000 + 10 * number])[0].landing_y
    if not np.isfinite(landing):
        return []
    return [Observed(tuple(draws[0].tolist()), params.trials.actuation_error, float(landing))]


def figures(lines: list[dict]) -> dict:
    """Figures of brief lines by kind of recording: each band's `summary`, and all together."""
    result: dict = {}
    kinds: dict[str, list[dict]] = {}
    for line in lines:
        job = job_of(line, OneRecording)
        kinds.setdefault(job.kind, []).append(line)
        if job.number == 0 and job.kind in COMPARED:  # what the paper's method has seen too
            kinds.setdefault(f"{job.kind}, {FIRST}", []).append(line)
    for kind, some in sorted(kinds.items()):
        good, bad = (
            [line for line in some if ("failed" in line) is lost] for lost in (False, True)
        )
        if not good:
            continue
        of_bands = summaries(good)
        result[kind] = {
            "together": together(of_bands),
            "settled": [sum(bool(line["settled"]) for line in good), len(good)],
            "refused": {f"{line['band']} {line['number']}": line["failed"] for line in bad},
            "bands": of_bands,
        }
    return plain(result)


def brief(line: dict) -> dict:
    """What a report has of a line of results: its job, scores and whether the fit settled."""
    short = {name: value for name, value in line.items() if name not in ("confidence", "delays")}
    return short | ({"settled": line["confidence"]["settled"]} if "confidence" in line else {})


def together(of_bands: dict[str, dict]) -> dict:
    """Means over bands, the worst recording of all, and how far the bands' coverages spread.

    `coverage_by_bands` is what bands drawn anew among these say in 90 of 100 cases.
    """
    bands = of_bands.values()
    bias = np.concatenate([band["bias"] for band in bands])
    covered = np.array([band["coverage"] for band in bands])
    each = np.concatenate([band["coverage_of_each"] for band in bands])
    rng = np.random.default_rng(0)
    resampled = rng.choice(covered, (BOOTSTRAP, len(covered))).mean(axis=1)
    return {
        "mean_size_of_bias": np.mean([band["mean_size_of_bias"] for band in bands]),
        "worst_bias": bias[np.nanargmax(np.abs(bias))],
        "mean_miss_m": np.mean([band["mean_miss_m"] for band in bands]),
        "launches": sum(band["launches"] for band in bands),
        "failed": sum(band["failed"] for band in bands),
        "coverage": covered.mean(),
        "coverage_by_bands": np.quantile(resampled, [0.05, 0.95]),
        "least_coverage": covered.min(),
        "least_coverage_of_a_recording": np.nanmin(each) if np.isfinite(each).any() else np.nan,
        "median_width": np.median([band["median_width"] for band in bands]),
    }


ROWS = {  # of the table
    "informative, virgin": "dips",
    "informative, virgin, one launch": "dips, one launch",
    f"informative, virgin, {FIRST}": "dips, first",
    "informative, virgin, the paper's method": "… by `paper`",
    "paper, virgin": "paper's pull",
    f"paper, virgin, {FIRST}": "paper's pull, first",
    "paper, virgin, the paper's method": "… by `paper`",
}
WORDS = {
    "bands": "rig (3)",
    "develop": "develop (4)",
    "sealed": "held-out (16)",
}


def table(contents: dict[str, dict]) -> list[str]:
    """The table of docs/identification.md, of the reports of some sets."""
    rows = [
        "| rubbers | recorded by | recordings | size of the bias, mean (worst) | inside,"
        " mean of bands (least band; least recording) | width |",
        "|---|---|---:|---:|---:|---:|",
    ]
    percent = "{:.0f} %".format
    shown = {name: words for name, words in WORDS.items() if name in contents}
    for name, words in shown.items():
        for kind, how in ROWS.items():
            if kind not in (of := contents[name]["figures"]):
                continue
            means, count = of[kind]["together"], of[kind]["settled"][1]
            size, worst = 100 * means["mean_size_of_bias"], 100 * means["worst_bias"]
            cells = [words, how, str(count), f"{size:.1f} % ({worst:+.1f} %)"]
            if means["coverage"] is None:
                cells += ["–", "–"]
            else:
                mean, band, recording = (
                    percent(100 * means[name])
                    for name in ("coverage", "least_coverage", "least_coverage_of_a_recording")
                )
                cells += [f"{mean} ({band}; {recording})", f"{100 * means['median_width']:.1f} %"]
            rows.append(re.sub(r"-(?=\d)", "−", row(*cells)))
    for name, words in shown.items():
        there, whole = contents[name]["jobs"]
        if there < whole:
            rows += ["", f"Of {words} {there} of {whole} identifications have run."]
    return rows


def sentence(content: dict) -> list[str]:
    """What README says of them, of the report of the sealed rubbers."""
    kind = content["figures"]["informative, virgin"]
    means, count = kind["together"], kind["settled"][1]
    size, worst, inside, width = (
        100 * means[key] for key in ("mean_size_of_bias", "worst_bias", "coverage", "median_width")
    )
    least = 100 * means["least_coverage"]
    text = (
        f"On {len(kind['bands'])} held-out virtual rubbers, with dips ({count} recordings),"
        f" predictions are off by {size:.1f} % of the distance (at worst {abs(worst):.1f} %). Of"
        f" the launches {inside:.0f} % land in 90 % intervals, which are {width:.0f} % wide; of the"
        f" least covered rubber {least:.0f} % do."
    )
    return paragraph(text)


def report_of(name: str) -> Path:
    return Path(f"reports/validation/landings-{name.replace('_', '-')}.json")


def main() -> None:
    parser = runner.parser(__doc__, None, WORK)
    parser.add_argument("set", choices=SETS)
    parser.add_argument("--recordings", type=int, default=len(FRESH), help="of each band, at most")
    args = parser.parse_args()
    if args.recordings < 1:
        raise UserError("--recordings: from 1 on")
    args.work = args.work / args.set
    todo = jobs(args.set, args.recordings)
    lines = runner.results_of(args, partial(identified, work=args.work), todo)
    recordings = plain([brief(line) for line in lines], 4)
    content = {
        "jobs": [len(lines), len(todo)],
        "plan.dips": [dict(dip) for dip in todo[0].params.plan.dips],
        "figures": figures(recordings),
        "recordings": recordings,
    }
    report = write_report(args.report or report_of(args.set), content, args.set)
    for name, some in report["figures"].items():
        print(name, some["together"], some["settled"])


if __name__ == "__main__":
    errors.run(main)
