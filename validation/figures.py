"""`sling figures`: of which code each JSON under reports/ is, and whether it meets what it asks.

A file with `code` (pipeline/base/environment.py) is compared folder by folder. One
that a stage writes is compared by DVC. For the others the digest of the simulator and the commit
decide, as far as they can: any change since then of what its command's script imports makes such a
file older, and where the command names no script, any change under pipeline/ or validation/.
"""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from pipeline.base.code import CODE, ROOT, digest, digests
from pipeline.base.errors import UserError
from pipeline.base.fingerprint import fingerprint
from pipeline.params import Params, load
from stages.start import stage_of

TODAY, OLDER = "today", "older code"
UNKNOWN = "unknown: written before digests"
NOT_TOLD = "unknown: DVC cannot tell"
PATTERNS = "summary.json bands/*/card.json simulator*.json */*.json validation/*/*.json".split()
SIMULATOR = "pipeline/simulator"
PARTS = ("pipeline", "validation")  # whose changes since a commit count
SCRIPT = re.compile(r"\bvalidation[./][\w./]+")  # in a command, as a module or as a file


@dataclass(frozen=True)
class CommittedFigures:
    """One JSON file.

    Attributes:
        file: From the project's root.
        state: TODAY, OLDER, or why it is unknown.
        digest: Of all the code that it names; None where it names none.
        changed: Folders that are other than they were, as far as the file names them.
        met: Whether it meets what it asks; None where it asks nothing.
    """

    file: str
    state: str
    digest: str | None
    changed: list[str]
    met: bool | None


def listed(
    root: Path,
    outdated: Callable[[Path, Iterable[str], tuple[str, ...]], Mapping[str, bool | None]],
    code: Path = ROOT,
) -> list[CommittedFigures]:
    """Every JSON file under root/reports, held against the sources in `code`.

    Args:
        outdated: DVC's answer of stages, by name (app/flow/graph.py).

    Raises:
        UserError: There are none, or one of them is no JSON object.
    """
    reports = root / "reports"
    files = list(dict.fromkeys(file for kind in PATTERNS for file in sorted(reports.glob(kind))))
    if not files:
        raise UserError(f"{reports}: no figures; run this in the project's folder")
    at = root / "params.yaml"
    params = load(at) if at.is_file() else None
    names = {stage for file in files if (stage := _stage(file, root, params))}
    states = {None: NOT_TOLD, True: OLDER, False: TODAY}
    stages = (
        {name: states[old] for name, old in outdated(root, names, CODE).items()} if names else {}
    )
    return [
        _figures(file, root, code, stages.get(_stage(file, root, params) or "")) for file in files
    ]


def shown(figures: list[CommittedFigures]) -> str:
    """A table, and how many are of which code."""
    words = {True: "met", False: "not met", None: "-"}
    rows = [("file", "code", "state", "")]
    rows += [
        (figure.file, figure.digest or "-", figure.state, words[figure.met]) for figure in figures
    ]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
    counts = [sum(figure.state == state for figure in figures) for state in (TODAY, OLDER)]
    counted = f"{counts[0]} of {len(figures)} are of today's code, {counts[1]} of older code"
    unmet = sum(figure.met is False for figure in figures)
    return "\n".join([*lines, "", f"{counted}; {unmet} do not meet what they ask"])


def as_json(figures: list[CommittedFigures]) -> str:
    return json.dumps({"figures": [asdict(figure) for figure in figures]})


def _figures(file: Path, root: Path, code: Path, state: str | None) -> CommittedFigures:
    """One file; `state` is what is already known of it."""
    name = file.relative_to(root).as_posix()
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise UserError(f"{name}: cannot be read: {error}") from error
    if not isinstance(content, dict):
        raise UserError(f"{name}: must hold a JSON object")
    code_digests = content.get("code") or {}
    if not code_digests and isinstance(content.get("simulator"), str):
        code_digests = {SIMULATOR: content["simulator"]}
    changed = [part for part, retained in code_digests.items() if digest(code / part) != retained]
    if not state and changed:
        state = OLDER
    elif not state:
        state = TODAY if content.get("code") else _by_commit(content, code)
    return CommittedFigures(name, state, _together(code_digests), changed, _met(content))


def _together(code_digests: dict[str, str]) -> str | None:
    """One digest of several."""
    if len(code_digests) < 2:
        return next(iter(code_digests.values()), None)
    return fingerprint(json.dumps(code_digests, sort_keys=True))[:12]


def _met(content: dict) -> bool | None:
    """Whether a campaign met what it asks, or a verification kept all its limits."""
    if isinstance(content.get("met"), bool):
        return content["met"]
    checks = [check for part in content.get("sections", []) for check in part.get("checks", [])]
    limited = [check["met"] for check in checks if check.get("met") is not None]
    return all(limited) if limited else None


def _by_commit(content: dict, code: Path) -> str:
    """Judge by Git's diff of sources since then; a dirty commit is known to be older at most."""
    commit = content.get("commit")
    if not isinstance(commit, str):
        return UNKNOWN
    clean = commit.removesuffix("-dirty")
    try:
        words = ["git", "diff", "--quiet", "--end-of-options", clean, "--", *_parts(content, code)]
        status = subprocess.run(words, cwd=code, capture_output=True, check=False).returncode
    except OSError:
        return UNKNOWN
    same = TODAY if clean == commit else UNKNOWN
    return {0: same, 1: OLDER}.get(status, UNKNOWN)


def _parts(content: dict, code: Path) -> list[str]:
    """What the script of a figure's command imports today, if it names one."""
    command = f"{content.get('alone', '')} {content.get('command', '')}"
    for name in SCRIPT.findall(command):
        script = name.removesuffix(".py").replace(".", "/")
        for file in (code / f"{script}.py", code / script / "__main__.py"):
            if file.is_file():
                return [*digests(file, root=code)]
    return [*PARTS]


def _stage(file: Path, root: Path, params: Params | None) -> str | None:
    """The stage that writes a file, if one does."""
    parts = file.relative_to(root / "reports").parts
    if parts == ("summary.json",):
        return "report"
    if parts[0] != "bands":
        return None
    stage = stage_of(params, "card", parts[1]) if params else None
    return stage or f"card@{parts[1]}"
