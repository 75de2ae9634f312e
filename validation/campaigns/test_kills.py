"""Flows of the real stages, killed again and again at random: the same bytes as undisturbed."""

import hashlib
import os
import shutil
import signal
import subprocess
import time
from collections import Counter
from collections.abc import Iterator
from itertools import cycle, islice
from pathlib import Path

import numpy as np
import psutil
import pytest
from ruamel.yaml import YAML

from tests.app.flow.killing import PROMPT, SLING, Run, told
from tests.project import ROOT, wait
from tests.test_pipeline import TINY, Copy

pytestmark = pytest.mark.validation

KILLS, SEED = 24, 1
VICTIMS = ("process", "group", "process", "flow")
LONGEST = 20.0  # s between kills
STARTED, ENDED = 180.0, 1200.0  # s that a flow may take to its first stage, and in all
FLOW = (*SLING, "flow", "--workers", "2")
MADE = ("data", "reports", "dvc.lock")
KEPT = (".checkpoints", "logs", ".dvc/cache", ".dvc/tmp", ".prefect")


def contents(folder: Path) -> dict[str, str]:
    """Digest of every file that a run makes, but dvc.lock, and run.js: when and where it ran."""
    files = [file for top in ("data", "reports") for file in (folder / top).rglob("*")]
    return {
        str(file.relative_to(folder)): hashlib.md5(file.read_bytes()).hexdigest()
        for file in files
        if file.is_file() and file.name != "run.js"
    }


def locked(folder: Path) -> dict[str, dict[str, str]]:
    """Digests of outputs and inputs in dvc.lock, by stage."""
    stages = YAML(typ="safe").load(folder / "dvc.lock")["stages"]
    return {
        name: {one["path"]: one["md5"] for kind in ("deps", "outs") for one in entry[kind]}
        for name, entry in stages.items()
    }


def kind(command: str) -> str:
    """Which part of a flow a process plays, by its command line; empty: none that is struck."""
    if "stages." in command and "repro" not in command:
        return f"stage {command.partition('stages.')[2].split()[0]}"
    for word, part in (
        ("guard.py", "guard"),
        ("repro", "DVC"),
        ("server", "Prefect's server"),
        ("spawn_main", "worker of a stage"),
    ):
        if word in command:
            return part
    return ""


def strike(run: Run, flow: subprocess.Popen, victim: str, rng: np.random.Generator) -> str | None:
    """Kill at once; what was hit, None if nothing was there any more."""
    if victim == "flow":
        flow.kill()
        return "flow"
    others = [one for one in run.alive() if one.pid != flow.pid and kind(told(one))]
    if not others:
        return None
    hit = others[rng.integers(len(others))]
    what = kind(told(hit))
    try:
        if victim == "group":
            os.killpg(os.getpgid(hit.pid), signal.SIGKILL)
        else:
            hit.kill()
    except (ProcessLookupError, psutil.NoSuchProcess):
        return None
    return what


def struck(run: Run, victims: Iterator[str], rng: np.random.Generator) -> tuple[int, list[dict]]:
    """A flow that is struck until it ends: its exit status, and where it was hit."""
    flow, blows, start = run.start(*FLOW), [], time.monotonic()
    ended = lambda: flow.poll() is not None  # noqa: E731
    if not wait(lambda: " | begins" in run.said or ended(), STARTED):
        flow.kill()
    while not wait(ended, rng.uniform(0, LONGEST)):
        victim = next(victims, None)
        if victim is None:
            break
        hit = strike(run, flow, victim, rng)
        if hit:
            blows.append({"sent_to": victim, "hit": hit, "after_s": time.monotonic() - start})
    return flow.wait(ENDED), blows


def begin(folder: Path) -> None:
    """As nothing had ever run, but for Python's and the compilers' caches."""
    for name in (*MADE, *KEPT):
        path = folder / name
        shutil.rmtree(path, ignore_errors=True) if path.is_dir() else path.unlink(missing_ok=True)


def undisturbed(folder: Path) -> tuple[Copy, float]:
    folder.mkdir()
    copy, start = Copy(folder / "copy"), time.monotonic()
    copy.dvc("repro")
    return copy, time.monotonic() - start


def test_a_flow_killed_again_and_again_ends_in_the_same_bytes(tmp_path, progress, record) -> None:
    whole, seconds = undisturbed(tmp_path / "whole")
    expected = contents(whole.folder), locked(whole.folder)
    progress(f"  undisturbed `dvc repro`: {seconds:.0f} s, {len(expected[1])} stages")
    (tmp_path / "killed").mkdir()
    copy = Copy(tmp_path / "killed" / "copy")
    rng, kills, rounds, faults = np.random.default_rng(SEED), [], [], []
    start = time.monotonic()
    while len(kills) < KILLS or not rounds:
        run = Run(copy.folder, DVC_SITE_CACHE_DIR=copy.environment["DVC_SITE_CACHE_DIR"])
        victims = islice(cycle(VICTIMS), len(kills), KILLS)
        status, blows = struck(run, victims, rng)
        kills += blows
        progress(f"  {len(kills)} kills; status {status}: {[one['hit'] for one in blows]}")
        left = run.left()
        if left:
            faults.append(f"after kill {len(kills)} there lives still {left}")
        if "Traceback" in run.said or (status and not blows):
            faults.append(f"after kill {len(kills)}, status {status}: {run.said[-2000:]}")
            progress(f"  fault: {faults[-1]}")
        if status and not blows:
            break
        if status == 0:
            same = {
                "files": contents(copy.folder) == expected[0],
                "locks": locked(copy.folder) == expected[1],
                "nothing_more": copy.dvc("repro") == set(),
                "no_temporaries": not temporaries(copy.folder),
            }
            rounds.append({"kills_before": len(kills), **same})
            progress(f"  whole after {len(kills)} kills: {same}")
            begin(copy.folder)
            copy("git", "checkout", "-q", ".")
    met = not faults and len(kills) >= KILLS
    met = met and all(all(value is not False for value in one.values()) for one in rounds)
    record(
        "kills",
        asked=f"A flow of the whole DAG on a tiny budget, killed {KILLS} times by SIGKILL at random"
        " moments (the flow, a process of it, a process group) and begun again when it ends: no"
        f" process lives {PROMPT:g} s later, no lock or temporary file stays, and every output"
        " and every digest in dvc.lock is that of an undisturbed `dvc repro`.",
        met=met,
        also=[ROOT / "app/flow/run.py", *(ROOT / "stages").glob("[a-z]*.py")],
        settings={"kills": KILLS, "seed": SEED, "latest_s": LONGEST, "budget": TINY},
        figures={
            "undisturbed_s": seconds,
            "killed_s": time.monotonic() - start,
            "stages": len(expected[1]),
            "files": len(expected[0]),
            "hit": dict(Counter(one["hit"] for one in kills)),
            "kills": kills,
            "rounds": rounds,
            "faults": faults,
        },
    )
    assert met, (faults, rounds)


def temporaries(folder: Path) -> list[Path]:
    """What a killed writer may leave beside its file, DVC's and Prefect's own folders apart."""
    tops = [folder / name for name in ("data", "reports", ".checkpoints", "logs")]
    return [*folder.glob("*.tmp"), *(file for top in tops for file in top.rglob("*.tmp"))]
