"""What becomes of the faults that labs report: corrected, reported, or silently wrong.

    python -m validation.campaigns.field --orange FOLDER

Each fault of validation/recordings/faults.py is done to orange_2 in FOLDER and to a recording of
the rig, in three sizes. What the checks say of it is kept; where no check of the fault's own
concern speaks, the band is identified as if nothing were wrong, from the sound recording's values
on, and compared with them; a fit that does not settle says so on the card. All sound recordings are
checked too: each finding there is a false alarm. Results are lines of results.jsonl in --work: a
run that was killed goes on from there.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import sling2sim2real as s2s
from pipeline.params import Params, load
from sling2sim2real.base import errors
from sling2sim2real.base.errors import UserError
from validation import orange
from validation.campaigns import runner
from validation.projects import with_section
from validation.recordings.faults import FAULTS
from validation.reports import row, write_report
from validation.rubbers import DEVELOP, SPENT, rubbers, with_rubbers

WORK, REPORT = Path("data/field"), Path("reports/validation/field.json")
SOUND = "none"  # the fault of a sound recording
FAULTY = "orange_2", "band1_1001"  # what faults are done to
ORANGE = "orange", "orange_2", "orange_3"
RIG = tuple(f"band{band}_{seed}" for seed in (1001, 1002) for band in (1, 2, 3))
RUBBERS = {name: seed for seed in (DEVELOP, SPENT) for name in rubbers(seed)}
MODULUS, DAMPING = 0.025, 1.6  # share of E, factor of s·d, within which a value is right
CORRECT, CAUTIONED, REFUSED = "correct", "cautioned", "refused"
MISNAMED, SILENT = "misnamed", "silently wrong"
OUTCOMES = CORRECT, CAUTIONED, REFUSED, MISNAMED, SILENT


@dataclass(frozen=True)
class Faulty:
    """One recording with one fault; a sound one has no size."""

    recording: str
    fault: str
    size: float


def params_of(recording: str) -> tuple[Params, str]:
    """Everything about a recording, and its band's name."""
    if recording in ORANGE:
        return orange.with_orange(load()), orange.NAME
    band, _, seed = recording.partition("_")
    if band in RUBBERS:
        return with_rubbers(load(), RUBBERS[band], 0), band
    return with_section(load(), "rig", seed=int(seed)), band


def recorded(recording: str, work: Path, folder: Path | None) -> Path:
    """The file of a sound recording, which the rig records where it is missing."""
    if recording in ORANGE:
        if folder is None:
            raise UserError(f"{recording}: give its folder, --orange")
        return folder / f"{recording}.mcap"
    path = work / f"{recording}.mcap"
    if not path.exists():
        from rig.recorder.record import record

        params, band = params_of(recording)
        path.parent.mkdir(parents=True, exist_ok=True)
        record(params, band, path)
    return path


def checked(path: Path, recording: str) -> tuple[list[dict], s2s.Episode | None]:
    """What the checks find, and the episode where there is one."""
    from sling2sim2real.recording.build import episode_of, process
    from sling2sim2real.recording.events import Part
    from sling2sim2real.recording.frames import geometry_of
    from sling2sim2real.recording.streams import read_recording

    params, band = params_of(recording)
    try:
        recorded = read_recording(path, params.setup)
        part = Part(recorded, geometry_of(recorded, params.setup))
        done = process(part, params.bands[band], params)
        episode = episode_of(done, band)
    except UserError as error:
        text = str(error).removeprefix(f"{path}: ")
        return [{"about": "", "what": text, "refused": True}], None
    findings = [
        {"about": finding.about, "what": finding.what, "refused": False}
        for finding in done.findings
    ]
    return findings, episode


def identified(episode: s2s.Episode, recording: str, start: s2s.Model | None) -> s2s.Identification:
    params, name = params_of(recording)
    band_params = params.bands[name]
    band = s2s.Band(band_params.mass, band_params.diameter, band_params.rest_length, name)
    settings = s2s.Settings.default(setup=params.setup.model_dump())
    return s2s.identify([episode], band, settings=settings, start=start)


def summary(identification: s2s.Identification) -> dict:
    """E [Pa] and s·d [s] with their intervals, and whether the fit converged."""
    names = {"modulus": "youngs_modulus", "damping": "damping_product"}
    values = {key: identification.intervals[name] for key, name in names.items()}
    return {
        key: [interval.value, interval.low, interval.high] for key, interval in values.items()
    } | {"settled": identification.settled}


def start_of(recording: str, episode: s2s.Episode | None, work: Path, folder: Path | None):
    """The sound recording's identification, which is kept."""
    path = work / f"{recording}.json"
    if not path.exists():
        if episode is None:
            episode = checked(recorded(recording, work, folder), recording)[1]
        assert episode is not None
        path.parent.mkdir(parents=True, exist_ok=True)
        identified(episode, recording, None).save(path)
    return s2s.Identification.load(path)


def tried(case: Faulty, work: Path, folder: Path | None) -> dict:
    """What came of one recording."""
    whole = recorded(case.recording, work, folder)
    if case.fault == SOUND:
        findings, episode = checked(whole, case.recording)
        if case.recording in FAULTY:
            start_of(case.recording, episode, work, folder)
        return {"findings": findings}
    from validation.recordings.streams import Bag

    fault = FAULTS[case.fault]
    with tempfile.TemporaryDirectory() as temporary:
        path = Path(temporary) / "faulty.mcap"
        bag = Bag.read(whole)
        fault.make(bag, case.size)
        bag.write(path)
        del bag
        findings, episode = checked(path, case.recording)
    if episode is None:
        return {"findings": findings, "outcome": REFUSED}
    if any(finding["about"] in fault.checks for finding in findings):
        return {"findings": findings, "outcome": CAUTIONED}
    sound = start_of(case.recording, None, work, folder)
    try:
        values = summary(identified(episode, case.recording, sound))
    except UserError as error:
        return {"findings": findings, "outcome": REFUSED, "identification": str(error)}
    right = summary(sound)
    outcome = outcome_of(is_right(right, values), values["settled"], bool(findings))
    return {
        "findings": findings,
        "outcome": outcome,
        "values": values,
        "modulus_error": values["modulus"][0] / right["modulus"][0] - 1,
        "damping_factor": values["damping"][0] / right["damping"][0],
    }


def outcome_of(right: bool, settled: bool, found: bool) -> str:
    """What came of a fit, where no check of the fault's own concern spoke."""
    if right:
        return CORRECT
    if not settled:
        return CAUTIONED
    return MISNAMED if found else SILENT


def is_right(sound: dict, values: dict) -> bool:
    """Whether E and s·d are those of the sound recording, and their intervals hold them."""
    near = abs(values["modulus"][0] / sound["modulus"][0] - 1) <= MODULUS
    factor = values["damping"][0] / sound["damping"][0]
    held = all(values[n][1] <= sound[n][0] <= values[n][2] for n in ("modulus", "damping"))
    return near and 1 / DAMPING <= factor <= DAMPING and held


def cases_of(recordings: list[str], sound: list[str], faults: list[str]) -> list[Faulty]:
    """Middle sizes first, then the largest and the smallest sizes, then the sound recordings."""

    def of_size(place: int) -> list[Faulty]:
        return [Faulty(r, name, FAULTS[name].sizes[place]) for r in recordings for name in faults]

    whole = [Faulty(name, SOUND, 0.0) for name in dict.fromkeys([*recordings, *sound])]
    return [*whole[:5], *of_size(1), *of_size(2), *of_size(0), *whole[5:]]


def report(args: argparse.Namespace, cases: list[Faulty], results: list[dict]) -> None:
    """Write what the results say."""
    sound = [result for result in results if result["fault"] == SOUND]
    faulty = [result for result in results if result["fault"] != SOUND]
    alarms = [
        {"recording": result["recording"], **finding}
        for result in sound
        for finding in result["findings"]
    ]
    families = dict.fromkeys(fault.family for fault in FAULTS.values())
    content = {
        "kind": "virtual",
        "asked": "What becomes of the faults that labs report: corrected, reported, or not.",
        "settings": {"modulus_within": MODULUS, "damping_factor_within": DAMPING},
        "cases": len(cases),
        "done": len(results),
        "sound_recordings": len(sound),
        "false_alarms": alarms,
        "counts": _counts(faulty),
        "families": {name: _family(faulty, name) for name in families},
        "results": results,
    }
    write_report(args.report, content, "--orange FOLDER" if args.orange else "", digits=5)
    print(f"{args.report}: {len(results)} of {len(cases)}, {content['counts']}", flush=True)
    print(f"{len(alarms)} false alarms on {len(sound)} sound recordings")


def _counts(results: list[dict]) -> dict[str, int]:
    counted = Counter(result.get("outcome", "failed") for result in results)
    return {
        name: counted[name] for name in (*OUTCOMES, "failed") if counted[name] or name == SILENT
    }


def _family(results: list[dict], family: str) -> dict:
    """Counts of a class, and the largest errors that nothing of its concern reported."""
    some = [result for result in results if FAULTS[result["fault"]].family == family]
    passed = [result for result in some if "modulus_error" in result]
    misses = [abs(result["modulus_error"]) for result in passed]
    factors = [max(result["damping_factor"], 1 / result["damping_factor"]) for result in passed]
    return _counts(some) | {
        "largest_modulus_error": max(misses, default=None),
        "largest_damping_factor": max(factors, default=None),
    }


def table(content: dict) -> list[str]:
    """The table of docs/recording.md, of a report's content."""
    rows = [
        "| class | tried | corrected | reported | wrong, another check spoke | silently wrong |"
        " largest undetected error of E, s·d |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, figures in content["families"].items():
        tried = sum(figures.get(outcome, 0) for outcome in (*OUTCOMES, "failed"))
        counts = figures.get(CORRECT, 0), figures.get(CAUTIONED, 0) + figures.get(REFUSED, 0)
        counts += figures.get(MISNAMED, 0), figures.get(SILENT, 0)
        error, factor = figures["largest_modulus_error"], figures["largest_damping_factor"]
        largest = "–" if error is None else f"{100 * error:.1f} %, {factor:.2g} times"
        if tried:
            rows.append(row(name, tried, *counts, largest))
    alarms = len(content["false_alarms"])
    return [*rows, "", f"False alarms on {content['sound_recordings']} sound recordings: {alarms}."]


def main() -> None:
    parser = runner.parser(__doc__, REPORT, WORK)
    parser.add_argument("--orange", type=Path, help="folder of the recordings of that band")
    parser.add_argument("--faults", nargs="+", default=[*FAULTS], help="(default: all)")
    args = parser.parse_args()
    faulty = [name for name in FAULTY if args.orange or name not in ORANGE]
    sound = [*(ORANGE if args.orange else ()), *RIG, *(f"{name}_0" for name in RUBBERS)]
    cases = cases_of(faulty, sound, args.faults)
    if not args.report_only:
        for recording in faulty:  # whose identification the others start from
            start_of(recording, None, args.work, args.orange)
    work = partial(tried, work=args.work, folder=args.orange)
    report(args, cases, runner.results_of(args, work, cases))


if __name__ == "__main__":
    errors.run(main)
