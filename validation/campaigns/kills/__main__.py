"""Kills and full disks at random moments, over four commands: in the end the bytes are the same.

    python -m validation.campaigns.kills --kills 100 --full-disks 20

`dvc repro`, `sling flow`, `sling fit` and a flow on a cluster work through the whole project on a
tiny budget. Each is killed (itself, one of its processes, or a process group) or finds its disk
full at a random moment, and is begun again, until it ends well. What it has made then is compared
with an undisturbed run's. Results are lines of results.jsonl in --work; the same command goes on
where it was stopped.
"""

from __future__ import annotations

import shutil
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

from pipeline.base import errors
from pipeline.base.code import ROOT, digests
from pipeline.base.errors import UserError
from pipeline.base.fingerprint import fingerprint
from validation.campaigns.kills import compare, full_disk, strike
from validation.campaigns.kills.commands import (
    BUDGET,
    COMMANDS,
    RECORDING,
    FitCopy,
    ReproCopy,
    StruckCopy,
    orphans,
    source,
)
from validation.campaigns.runner import ResultLines, made_once, parser, read
from validation.projects import PROMPT, send
from validation.reports import write_report

WORK = Path("data/kills")
REPORT = ROOT / "reports/validation/kills.json"
SEED = 2
CHECKS = ("files", "digests", "nothing_more", "no_temporaries", "no_locks", "cache_whole")
ASKED = (
    "{kills} SIGKILLs at random moments over `dvc repro`, `sling flow`, `sling fit` and a flow on a"
    " cluster (the command, a process of it, a process group), and {disks} disks that become full:"
    " one clear line of a full disk, no process {prompt:g} s later, and at the end of each round no"
    " lock and no temporary file is left, and every file, every digest in dvc.lock and DVC's cache"
    " are those of an undisturbed run."
)


def undisturbed(work: Path) -> dict[str, dict]:
    """What `dvc repro` and `sling fit` make when nobody disturbs them; kept in `work`."""
    return made_once(work / "undisturbed.json", lambda: _undisturbed(work))


def _undisturbed(work: Path) -> dict[str, dict]:
    results = {}
    for kind in (ReproCopy, FitCopy):
        copy = kind(work / "undisturbed" / kind.name.replace(" ", "-"), work)
        copy.begin()
        begun, start = compare.contents(copy.folder), time.monotonic()
        copy(*copy.words)
        results[kind.name] = {
            "seconds": round(time.monotonic() - start, 1),
            "begun": begun,
            "files": compare.contents(copy.folder),
            "locks": compare.locked(copy.folder),
        }
        say(f"undisturbed {kind.name}: {results[kind.name]['seconds']:.0f} s")
        if kind is ReproCopy:
            shutil.copy(copy.folder / "data/raw/band1/band1.mcap", work / RECORDING)
    return results


def say(line: str) -> None:
    print(f"{time.strftime('%H:%M:%S')} {line}", flush=True)


def ended(copy: StruckCopy, expected: dict) -> dict[str, bool]:
    """Compare what is there at the end of a round with the undisturbed run's."""
    copies = copy.copies
    caches = [folder / ".dvc/cache" for folder in copies] + [copy.disk / "remote"]
    fresh = copy("dvc", "status", *copy.stages)
    return {
        "files": compare.contents(copy.folder) == expected["files"],
        "digests": compare.locked(copy.folder) == expected["locks"],
        "nothing_more": "up to date" in fresh,
        "no_temporaries": not any(map(compare.temporaries, copies)),
        "no_locks": not any(map(compare.held, copies)),
        "cache_whole": not any(map(compare.broken, caches)),
    }


def disturb(
    copy: StruckCopy,
    by: str,
    wanted: int,
    lines: ResultLines,
    expected: dict,
    attempt: Callable[[int, int], dict],
) -> None:
    """Disturb a command so often, and let it end well then."""
    name, going = copy.name, False
    while True:
        before = lines.where(what="attempt", name=name, by=by)
        count = sum(map(disturbances, before))
        whole = lines.where(what="round", name=name, by=by)
        if count >= wanted and whole and whole[-1]["after"] == count:
            return
        if not going and not (before and not before[-1]["ended"] and copy.folder.is_dir()):
            copy.begin()
        going = True
        result = attempt(len(before), wanted - count)
        wholes = (expected["files"], expected["begun"])
        for folder in copy.copies:
            if halves := compare.halves(folder, *wholes):
                result["faults"].append(f"neither as before nor as in the end: {halves[:5]}")
        result["mended"] = copy.mend()
        result["ended"] = result["status"] == 0
        lines.add({"what": "attempt", "name": name, "by": by, **result})
        count += disturbances(result)
        summary = (
            [kill["hit"] for kill in result.get("kills", ())]
            or result.get("said")
            or "not disturbed"
        )
        say(f"{name}, {by} {count} of {wanted}: {result['seconds']:.0f} s, {summary}")
        for fault in result["faults"]:
            say(f"  fault: {fault}")
        if result["ended"]:
            same = ended(copy, expected)
            left = {
                "temporaries": [file for here in copy.copies for file in compare.temporaries(here)],
                "left_in_tmp": sorted(file.name for file in (copy.place / "tmp").iterdir()),
            }
            row = {"what": "round", "name": name, "by": by, "after": count}
            lines.add({**row, **same, **left})
            say(f"{name}, {by}: whole after {count}: {same}")
            going = False
        elif not disturbances(result) and result["faults"]:
            raise UserError(f"{name} fails though nothing disturbs it: {result['faults'][-1]}")


def disturbances(attempt: dict) -> int:
    """How many kills or full disks there were in an attempt."""
    if "kills" in attempt:
        return len(attempt["kills"])
    return int(attempt["status"] != 0 and attempt["full_after_s"] is not None)


def shares(count: int, names: list[str]) -> dict[str, int]:
    """`count` shared out as evenly as can be."""
    return {name: (count + place) // len(names) for place, name in enumerate(names)}


def campaign(
    name: str, by: str, wanted: int, work: Path, lines: ResultLines, expected: dict
) -> None:
    """All kills, or all full disks, of a command."""
    copy = COMMANDS[name](work / by.replace(" ", "-") / name.replace(" ", "-"), work)

    def attempt(number: int, most: int) -> dict:
        if by == "kill":
            return strike.struck(copy, number, most, SEED)
        return full_disk.filled(copy, number, SEED, most > 0)

    with ExitStack() as stack:
        if by == "full disk":
            try:
                stack.enter_context(full_disk.small_disk(copy.disk))
            except UserError as error:  # the report will say that it has none
                return say(str(error))
        stack.callback(copy.end)
        disturb(copy, by, wanted, lines, expected.get(name, expected[ReproCopy.name]), attempt)


def report(lines: ResultLines, kills: int, disks: int, expected: dict, names: list[str]) -> dict:
    """What the lines come to."""
    attempts = lines.where(what="attempt")
    rounds = lines.where(what="round")
    done = {
        name: {
            by: sum(map(disturbances, lines.where(what="attempt", name=name, by=by)))
            for by in ("kill", "full disk")
        }
        for name in names
    }
    killed, filled = (sum(counts[by] for counts in done.values()) for by in ("kill", "full disk"))
    faults = [
        {"name": attempt["name"], "by": attempt["by"], "fault": fault}
        for attempt in attempts
        for fault in attempt["faults"]
    ]
    same = all(line[check] for line in rounds for check in CHECKS)
    complete = killed >= kills and filled >= disks and all(
        (whole := lines.where(what="round", name=name, by=by))
        and whole[-1]["after"] == done[name][by]
        for name in names
        for by in ("kill", "full disk")
        if done[name][by]
    )  # fmt: skip
    hits = Counter(kill["hit"] for attempt in attempts for kill in attempt.get("kills", ()))
    return {
        "asked": ASKED.format(kills=kills, disks=disks, prompt=PROMPT),
        "met": complete and same and not faults,
        "settings": {
            "kills": kills,
            "full_disks": disks,
            "seed": SEED,
            "mean_s": {"kill": strike.MEAN, "full disk": full_disk.MEAN},
            "disk": f"tmpfs of {full_disk.SIZE} MB, mounted by root; at most {full_disk.ROOM} bytes"
            " of it stay free until the command has ended",
            "budget": BUDGET,
        },
        "figures": {
            "kills": killed,
            "full_disks": filled,
            "of": done,
            "hit": dict(hits.most_common()),
            "half_lock_files_cut_back": sum(attempt["mended"] for attempt in attempts),
            "attempts": len(attempts),
            "seconds": round(sum(attempt["seconds"] for attempt in attempts), 1),
            "undisturbed_s": {name: run["seconds"] for name, run in expected.items()},
            "files": {name: len(run["files"]) for name, run in expected.items()},
            "stages": {name: len(run["locks"]) for name, run in expected.items()},
            "rounds": rounds,
            "left_in_tmp": sorted({file for some in rounds for file in some["left_in_tmp"]}),
            "said_of_full_disks": dict(
                Counter(attempt["said"] for attempt in attempts if attempt.get("said"))
            ),
            "faults": faults,
        },
    }


def main() -> int:
    options = parser(__doc__, REPORT, WORK, many=False)
    options.add_argument("--kills", type=int, default=100)
    options.add_argument("--full-disks", type=int, default=20)
    options.add_argument("--commands", nargs="+", choices=COMMANDS, default=list(COMMANDS))
    options.add_argument("--at-once", type=int, default=2, help="commands at a time (default: 2)")
    arguments = options.parse_args()
    work, names = arguments.work.resolve(), arguments.commands
    work.mkdir(parents=True, exist_ok=True)
    for process in orphans(work):
        send(process)
    project = source(work)
    lines, expected = ResultLines(work / "results.jsonl"), undisturbed(work)
    todo = {
        "kill": shares(arguments.kills, names),
        "full disk": shares(arguments.full_disks, names),
    }
    with ThreadPoolExecutor(arguments.at_once) as pool:
        requested = [
            pool.submit(campaign, name, by, wanted[name], work, lines, expected)
            for by, wanted in todo.items()
            for name in names
            if wanted[name]
        ]
        for task in requested:
            task.result()
    content = report(lines, arguments.kills, arguments.full_disks, expected, names)
    for fault in content["figures"]["faults"]:  # wherever it ran
        fault["fault"] = fault["fault"].replace(str(work), "WORK")
    ran = [project / "app/cli.py", *sorted((project / "stages").glob("[a-z]*.py"))]
    content |= {
        "commit": read(work / "source.json")["commit"],
        "simulator": fingerprint(project / "pipeline/simulator")[:12],
        "code": digests(project / Path(__file__).relative_to(ROOT), *ran, root=project),
    }
    command = f"--kills {arguments.kills} --full-disks {arguments.full_disks}"
    write_report(arguments.report, content, command)
    say(f"{'met' if content['met'] else 'NOT met'}: {arguments.report}")
    return 0 if content["met"] else 1


if __name__ == "__main__":
    errors.run(main)
