"""`sling verify`: every check of the simulator, as reports/simulator.md and simulator.json.

Another device than the CPU has pages of its own, such as reports/simulator-cuda-0.md.
"""

from __future__ import annotations

import math
import os
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from pipeline.base.environment import environment
from pipeline.base.errors import UserError
from pipeline.base.files import replacing, write_json, write_text
from validation.benchmarks.timing import available
from validation.reports import plain
from validation.simulator import (
    agreement,
    at_rest,
    damping,
    energy,
    five_parameters,
    free_motion,
    launching,
    robustness,
    rubber,
)
from validation.simulator.finding import Bench, Measure, Theme, unmet

HEAD = """\
# The simulator, held against what is known

`sling verify` writes this page: {met} of {limited} limits are kept{missed}. Figures without a \
limit are stated for what they tell. [{name}.json]({name}.json) keeps figures and environment.

**What is solved.** A band is an extensible director rod: each edge has a deformation \
gradient F = [g a b] of its stretch and its section, with the stable neo-Hookean law without its \
logarithm (Smith, de Goes and Kim 2018), W = μ/2 (|F|² − 3) − μ (J − 1) + λ/2 (J − 1)², J = det F; \
λ is the first Lamé parameter plus μ, so that E and ν are the small-strain ones. Joints between \
edges bend with E I and twist with G J of the round section. Viscous stress is d times the rate of \
the elastic stress, its shape part times s. Each step, of second order (BDF2), is solved \
by Newton's method on the whole band.

Device {device}; commit {commit}.
"""
SECTIONS: dict[str, Callable[..., Theme]] = {
    "at rest": at_rest.section,
    "the kernel and its reference implementation": agreement.section,
    "damping": damping.section,
    "free motion": free_motion.section,
    "energy": energy.section,
    "the five parameters": five_parameters.section,
}
CAMPAIGNS = {
    "launches": launching.section,
    "random parameters": robustness.section,
    "the law rubber": rubber.section,
}


def verify(
    params,
    device: str = "cpu",
    progress: Callable[[str], None] = print,
    *,
    extra: dict[str, Callable[[Bench], Theme]] | None = None,
    root: Path = Path("."),
) -> list[Theme]:
    """Run every check and write the report.

    Args:
        extra: Sections that live elsewhere, by title; one that raises UserError was not run, and
            the report says why.

    Raises:
        UserError: There is no such device.
    """
    if not available(device):
        raise UserError(f"device {device}: not there; cpu is, and cuda:0 where there is a GPU")
    sections = []
    name = "simulator" if device == "cpu" else f"simulator-{device.replace(':', '-')}"
    with tempfile.TemporaryDirectory() as figures:
        bench = Bench(params, device, os.cpu_count() or 1, Path(figures))
        jobs = SECTIONS | {
            title: partial(section, progress=progress) for title, section in CAMPAIGNS.items()
        }
        jobs |= extra or {}
        for number, (title, section) in enumerate(jobs.items(), 1):
            progress(f"{number}/{len(jobs)} {title}")
            began = time.perf_counter()
            try:
                sections.append(section(bench))
            except UserError as error:
                sections.append(Theme(title, [], not_run=str(error)))
                progress(f"  not run: {error}")
            for check in unmet(sections[-1].checks):
                progress(f"  NOT MET: {check.name}: {figure(check)}, limit {limit(check)}")
            progress(f"  {time.perf_counter() - began:.0f} s")
        for picture in sorted(Path(figures).glob("*.png")):
            with replacing(root / "reports" / name / picture.name) as temporary:
                temporary.write_bytes(picture.read_bytes())
    provenance = environment(device, f"sling verify --device {device}")
    retained = ("device", "commit") + (() if device == "cpu" else ("device_name",))
    context = {name: provenance[name] for name in retained}
    write_text(root / f"reports/{name}.md", markdown(sections, context, name))
    write_json(root / f"reports/{name}.json", context | {"sections": list(map(_entry, sections))})
    return sections


def summary(sections: list[Theme]) -> tuple[str, int]:
    """A line for the terminal, and how many limits are not kept."""
    checks = [check for section in sections for check in section.checks]
    missed = unmet(checks)
    limited = sum(check.met is not None for check in checks)
    lines = [f"not met: {check.name}: {figure(check)}, limit {limit(check)}" for check in missed]
    lines += [
        f"not run: {section.title}: {section.not_run}" for section in sections if section.not_run
    ]
    lines.append(f"{limited - len(missed)} of {limited} limits kept")
    return "\n".join(lines), len(missed)


def markdown(sections: list[Theme], context: dict, name: str) -> str:
    """The whole page; `name` is that of its pictures' folder and of the JSON beside it."""
    checks = [check for section in sections for check in section.checks]
    missed, limited = len(unmet(checks)), sum(check.met is not None for check in checks)
    head = HEAD.format(
        met=limited - missed,
        limited=limited,
        missed=f", {missed} not" if missed else "",
        name=name,
        device=", ".join(filter(None, (context["device"], context.get("device_name")))),
        commit=context["commit"],
    )
    return "\n".join([head, *(_part(section, name) for section in sections)])


def _part(section: Theme, folder: str) -> str:
    lines = [f"## {section.title}", ""]
    if section.not_run:
        lines += [f"Not run: {section.not_run}.", ""]
    if section.text:
        lines += [section.text, ""]
    if section.checks:
        lines += [
            "| figure | | limit | met | held against | note |",
            "|---|---:|---:|---|---|---|",
            *map(_row, section.checks),
            "",
        ]
    for name, caption in section.pictures.items():
        lines += [f"![{caption}]({folder}/{name})", "", f"*{caption}*", ""]
    return "\n".join(lines)


def _row(check: Measure) -> str:
    met = {None: "", True: "yes", False: "**no**"}[check.met]
    cells = (check.name, figure(check), limit(check), met, check.against, check.note)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def figure(check: Measure) -> str:
    return f"{_short(check.value)} {check.unit}"


def limit(check: Measure) -> str:
    return "" if check.limit is None else f"≤ {_short(check.limit)} {check.unit}"


def _short(value: float) -> str:
    if not math.isfinite(value):
        return "no number"
    return "0" if value == 0 else f"{value:.2g}" if abs(value) < 0.1 else f"{value:.4g}"


def _entry(section: Theme) -> dict:
    return {
        "title": section.title,
        "checks": plain([check.entry for check in section.checks], 5),
        "details": section.details,
        "not_run": section.not_run or None,
    }
