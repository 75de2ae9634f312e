"""One density: landings of the rig's bands, and of rubbers that nobody chose.

Recordings and scores are kept in .checkpoints/density (SLING_DENSITY names another folder), from
which a campaign that was cut off goes on. validation/rubbers.py says which rubbers took part in
choosing the method, and by which rule.
"""

import json
import os
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from pipeline.base.code import ROOT, digests
from pipeline.base.fingerprint import fingerprint
from pipeline.base.machine import cores
from pipeline.episode.episode import Episode
from pipeline.launching.trials.spread import landing_intervals
from pipeline.params import Params, load
from pipeline.recording.build import build_episodes
from validation import density
from validation.campaigns import rig_scores
from validation.campaigns.rig_scores import calibrated_clamps, result, sling_of, summary
from validation.campaigns.runner import OURS, PAPER, each
from validation.orange import landings, with_orange
from validation.projects import DEFAULTS
from validation.rubbers import DEVELOP, RECORDINGS, SEALED, rubbers, with_rubbers

pytestmark = pytest.mark.validation

METHODS = OURS, PAPER
BANDS, FIVE = ("band1", "band2", "band3"), 5
FOLDER = Path(os.environ.get("SLING_DENSITY", ROOT / ".checkpoints/density"))
CODE = fingerprint(json.dumps(digests(Path(rig_scores.__file__))))[:12]  # of what scores hang on
RECORDINGS_OF_ORANGE = ROOT.parent / "shared/recordings"


class Identifications(NamedTuple):
    """Of bands, each by each of its tuples of recordings.

    Attributes:
        seed: Of the rubbers.
        known: Launches that are evidence.
    """

    seed: int
    bands: tuple[str, ...]
    numbers: tuple[tuple[int, ...], ...]
    method: str = OURS
    known: int = 0

    def params(self, recording: int) -> Params:
        """params.yaml with the rubbers, of a recording."""
        return with_rubbers(load(DEFAULTS), self.seed, recording)

    def results(self, band: str) -> list[dict]:
        """What is not there yet is made."""
        folder = FOLDER / CODE / str(self.seed)
        return [
            result(self.params, band, one, self.method, folder, self.known) for one in self.numbers
        ]


def one_by_one(count: int) -> tuple[tuple[int, ...], ...]:
    return tuple((number,) for number in range(count))


TOGETHER, KNOWN = (tuple(range(RECORDINGS)),), (1, 3)
DEVELOPED, UNSEEN = tuple(rubbers(DEVELOP)), tuple(rubbers(SEALED))
ALL = {
    **{f"rig, {how}": Identifications(DEVELOP, BANDS, one_by_one(FIVE), how) for how in METHODS},
    **{
        f"develop, {how}": Identifications(DEVELOP, DEVELOPED, one_by_one(RECORDINGS), how)
        for how in METHODS
    },
    "three": Identifications(DEVELOP, (*BANDS, *DEVELOPED), TOGETHER),
    **{
        f"{known} launches": Identifications(DEVELOP, BANDS, one_by_one(RECORDINGS), known=known)
        for known in KNOWN
    },
    "sealed": Identifications(SEALED, UNSEEN, one_by_one(RECORDINGS)),
    "sealed, the paper's": Identifications(SEALED, UNSEEN, ((0,),), PAPER),
    "sealed, three": Identifications(SEALED, UNSEEN, TOGETHER),
    "sealed, a launch": Identifications(SEALED, UNSEEN, ((0,),), known=1),
}


def make(seed: int, band: str) -> None:
    """Everything of one band, whose identifications share recordings."""
    for one in ALL.values():
        if one.seed == seed and band in one.bands:
            one.results(band)


@pytest.fixture(scope="module")
def results():
    """Scores of each band by a name in ALL; those of a seed are made when first asked for."""
    there = set()

    def of(name: str) -> dict:
        asked = ALL[name]
        if (seed := asked.seed) not in there:
            every = dict.fromkeys(b for one in ALL.values() if one.seed == seed for b in one.bands)
            for _ in each(partial(make, seed), every, cores()):
                pass
            there.add(seed)
        return {band: summary(asked.results(band)) for band in asked.bands}

    return of


def made_on() -> str:
    """Where the folder's scores were made, if not here: about.txt in it says so."""
    about = FOLDER / CODE / "about.txt"
    return about.read_text().strip() if about.exists() else "as below"


def mean_size(found: dict) -> float:
    """Mean over bands of the size of a band's mean error."""
    return float(np.mean([abs(one["mean_bias"]) for one in found.values()]))


def bootstrap(found: dict, count: int = 2000) -> list[float]:
    """90 % of the coverage when bands are drawn anew."""
    rng, each = np.random.default_rng(0), [one["coverage"] for one in found.values()]
    drawn = rng.choice(each, (count, len(each))).mean(axis=1)
    return np.quantile(drawn, [0.05, 0.95]).tolist()


def test_the_default_is_chosen_by_the_rule(results, progress, record) -> None:
    both = {how: results(f"rig, {how}") | results(f"develop, {how}") for how in METHODS}
    ours = both[OURS]
    sizes = {method: mean_size(one) for method, one in both.items()}
    for method, size in sizes.items():
        progress(f"  {method}: mean of |bias| {100 * size:.2f} %")
    record(
        "density-develop",
        asked="By the rule of validation/rubbers.py least_squares is the default: the mean over"
        " bands of |bias| is less than the paper's. On each of the rig's bands |bias| is at most"
        " 1.5 % in the mean of five recordings. All of this took part in choosing.",
        met=sizes[OURS] < sizes[PAPER]
        and all(abs(ours[band]["mean_bias"]) <= 0.015 for band in BANDS),
        settings={"recordings": FIVE, "of_rubbers": RECORDINGS, "made_on": made_on()},
        figures={
            "mean_size_of_bias": sizes,
            "bands": both,
            "coverage_by_bands": bootstrap(ours),
            "three_recordings": results("three"),
            "launches_as_evidence": {known: results(f"{known} launches") for known in KNOWN},
        },
    )
    assert sizes[OURS] < sizes[PAPER]


def test_rubbers_that_were_sealed(results, progress, record) -> None:
    one, paper = results("sealed"), results("sealed, the paper's")
    worst = max(abs(about["mean_bias"]) for about in one.values())
    progress(f"  sealed: mean of |bias| {100 * mean_size(one):.2f} %, worst {100 * worst:.2f} %")
    progress(f"  the paper's method: mean of |bias| {100 * mean_size(paper):.2f} %")
    record(
        "density-sealed",
        asked="Rubbers that took no part in choosing, run once: |bias| at most 2 % in the mean over"
        " bands and 4 % on the worst.",
        met=mean_size(one) <= 0.02 and worst <= 0.04,
        settings={"recordings": RECORDINGS, "seed": SEALED, "made_on": made_on()},
        figures={
            "kinds": {name: about for name, (_, about) in rubbers(SEALED).items()},
            "mean_size_of_bias": mean_size(one),
            "worst": worst,
            "coverage_by_bands": bootstrap(one),
            "one_recording": one,
            "paper_one_recording": paper,
            "paper_mean_size_of_bias": mean_size(paper),
            "three_recordings": results("sealed, three"),
            "one_launch_as_evidence": results("sealed, a launch"),
        },
    )
    assert mean_size(one) <= 0.02


@pytest.mark.skipif(
    not (RECORDINGS_OF_ORANGE / "orange_landings.csv").exists(),
    reason="the recordings of the orange band are not beside the project",
)
def test_recordings_that_this_project_did_not_make(params: Params, progress, record) -> None:
    params = with_orange(params)
    draws, measured = landings(RECORDINGS_OF_ORANGE)
    names = ("orange", "orange_2", "orange_3")
    episodes = [orange_episode(params, name) for name in names]
    figures = {}
    for name, own in [*zip(names, [[one] for one in episodes], strict=True), ("all", episodes)]:
        place = FOLDER / (name if name in names else names[0])
        sling = sling_of(params, "orange", OURS, place)
        calibrated, told = density.found(params, OURS, sling, own)
        error = calibrated(draws).landing_y / measured - 1
        ends = landing_intervals(calibrated, draws, calibrated.samples, 1e-3)
        figures[name] = {
            "bias": np.nanmean(error),
            "spread": np.nanstd(error),
            "inside": int(((measured >= ends[:, 0]) & (measured <= ends[:, 1])).sum()),
            "launches": len(measured),
            "mean_width": np.nanmean((ends[:, 1] - ends[:, 0]) / measured),
            "turn_damping": told["derived"]["turn_damping"],
            "pictures": [one["pictures"] for one in told["recordings"]],
        }
        progress(f"  {name}: {100 * figures[name]['bias']:+.2f} %")
    record(
        "density-orange",
        asked="Landings of a band that this project did not make: |bias| at most 2 % by each of its"
        " three recordings, 1.2 % by all together. No landing was evidence; the choice of"
        " `turn_damping` as a coordinate came from these recordings' pictures.",
        met=all(abs(figures[name]["bias"]) <= 0.02 for name in names)
        and abs(figures["all"]["bias"]) <= 0.012,
        settings={"arm_stiffness": None},
        figures=figures,
    )
    assert all(one["inside"] >= 0.85 * one["launches"] for one in figures.values())


def orange_episode(params: Params, name: str) -> Episode:
    path, folder = RECORDINGS_OF_ORANGE / f"{name}.mcap", FOLDER / name
    if not (folder / "mounting.json").exists():
        calibrated_clamps(params, "orange", build_episodes(path, "orange", params)[0][0], folder)
    return Episode.load(folder / "episode")
