"""`sling verify`: compare the simulator with closed forms, finer steps and other engines.

    python -m validation.verify [--device cpu]

Run in the project's folder; writes reports/simulator.md, and of another device than the CPU a page
of its own, such as reports/simulator-cuda-0.md. Exit status 1 if a limit is not kept.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable
from pathlib import Path

from pipeline.params import load
from sling2sim2real.base import errors
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import write_text
from sling2sim2real.base.machine import gpus
from sling2sim2real.cli.command_line import Parser
from validation.engines import checks as engines
from validation.reports import environment, row
from validation.simulator import (
    agreement,
    at_rest,
    corotated,
    damping,
    energy,
    free_motion,
    friction,
    launching,
    robustness,
    rubber,
)
from validation.simulator.finding import Bench, Measure, Theme, unmet

HEAD = """\
# The simulator, held against what is known

`sling verify` writes this page: {met} of {count} limits are kept.

**What is solved.** A band is an extensible director rod: each edge has a deformation \
gradient F = [g a b] of its stretch and its section, with the stable neo-Hookean law without its \
logarithm (Smith, de Goes and Kim 2018), W = μ/2 (|F|² − 3) − μ (J − 1) + λ/2 (J − 1)², J = det F; \
λ is the first Lamé parameter plus μ, so that E and ν are the small-strain ones. Joints between \
edges bend with E I and twist with G J of the round section. Viscous stress is d times the rate of \
the elastic stress, its shape part times s. Each step, of second order (BDF2), is solved \
by Newton's method on the whole band.

Device {device}; commit {commit}.
"""
SECTIONS: dict[str, Callable[[Bench], Theme]] = {
    "at rest": at_rest.section,
    "the kernel and its reference implementation": agreement.section,
    "damping": damping.section,
    "free motion": free_motion.section,
    "energy": energy.section,
    "friction": friction.section,
    "launches": launching.section,
    "random parameters": robustness.section,
    "the law rubber": rubber.section,
    "the law corotated": corotated.section,
    "against MuJoCo": engines.section,
}


def verify(
    params,
    device: str = "cpu",
    progress: Callable[[str], None] = print,
    root: Path = Path("."),
) -> list[Theme]:
    """Run every check and write the report.

    A section that raises UserError, such as for want of MuJoCo, was not run, and the report says
    why.

    Raises:
        UserError: There is no such device.
    """
    if device not in {"cpu", *gpus()}:
        raise UserError(f"device {device}: not there; cpu is, and cuda:0 where there is a GPU")
    bench, sections = Bench(params, device, os.cpu_count() or 1), []
    for number, (title, section) in enumerate(SECTIONS.items(), 1):
        progress(f"{number}/{len(SECTIONS)} {title}")
        began = time.perf_counter()
        try:
            sections.append(section(bench))
        except UserError as error:
            sections.append(Theme(title, [], not_run=str(error)))
            progress(f"  not run: {error}")
        for check in unmet(sections[-1].checks):
            progress(f"  {_missed(check)}")
        progress(f"  {time.perf_counter() - began:.0f} s")
    name = "simulator" if device == "cpu" else f"simulator-{device.replace(':', '-')}"
    provenance = environment(device)
    if device != "cpu":
        device += f", {provenance['device_name']}"
    write_text(root / f"reports/{name}.md", markdown(sections, device, provenance["commit"]))
    return sections


def summary(sections: list[Theme]) -> tuple[str, int]:
    """A line for the terminal, and how many limits are not kept."""
    checks = [check for section in sections for check in section.checks]
    missed = unmet(checks)
    lines = [_missed(check) for check in missed]
    lines += [
        f"not run: {section.title}: {section.not_run}" for section in sections if section.not_run
    ]
    lines.append(f"{len(checks) - len(missed)} of {len(checks)} limits kept")
    return "\n".join(lines), len(missed)


def _missed(check: Measure) -> str:
    return f"not met: {check.name}: {_figure(check.value, check)}, limit {_limit(check)}"


def markdown(sections: list[Theme], device: str, commit: str) -> str:
    """The whole page."""
    checks = [check for section in sections for check in section.checks]
    met = len(checks) - len(unmet(checks))
    head = HEAD.format(met=met, count=len(checks), device=device, commit=commit)
    return "\n".join([head, *map(_part, sections)])


def _part(section: Theme) -> str:
    lines = [f"## {section.title}", ""]
    if section.not_run:
        lines += [f"Not run: {section.not_run}.", ""]
    if section.text:
        lines += [section.text, ""]
    if section.checks:
        lines += [
            row("figure", "", "limit", "met", "held against", "note"),
            "|---|---:|---:|---|---|---|",
            *map(_row, section.checks),
            "",
        ]
    return "\n".join(lines)


def _row(check: Measure) -> str:
    figure, met = _figure(check.value, check), "yes" if check.met else "**no**"
    cells = check.name, figure, _limit(check), met, check.against, check.note
    return row(*(cell.replace("|", "\\|") for cell in cells))


def _limit(check: Measure) -> str:
    return f"≤ {_figure(check.limit, check)}"


def _figure(value: float, check: Measure) -> str:
    if not math.isfinite(value):
        return "no number"
    digits = "0" if value == 0 else f"{value:.2g}" if abs(value) < 0.1 else f"{value:.4g}"
    return f"{digits} {check.unit}"


def parser() -> Parser:
    """Command line of `sling verify`."""
    parser = Parser(prog="sling verify", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--device", default="cpu", help="cpu (default) or cuda:0")
    return parser


def main() -> int:
    text, missed = summary(verify(load(), parser().parse_args().device))
    print(text)
    return int(missed > 0)


if __name__ == "__main__":
    errors.run(main)
