"""What the campaign on more recordings says of the paper's findings, in sentences."""

from __future__ import annotations

from pipeline.params import Params
from pipeline.report.run import paper
from pipeline.report.run.repeated import ALL, FILE, MeanInterval, Repeated
from pipeline.report.run.tables.repeated import PLAIN, ROWS, name_of

FEW = 0.2  # a rank correlation below which a lower loss says next to nothing
OURS = "least_squares"
CLAIMS = {  # of the paper, by the number of the table that shows it
    1: "its method lands nearer than those that fit the geometry alone",
    3: "its search beats other optimisers",
    4: "the covariance (c), several starts (m) and the term of work each help",
}


def claims(repeated: Repeated, params: Params) -> list[str]:
    """Ours beside the paper's method, then each finding of the paper's."""
    misses = repeated.miss[ALL]
    means = [f"**{name_of(m)}** {_mean(misses[m])}" for m in (OURS, paper.METHOD) if m in misses]
    count = max(misse.count for misse in misses.values())
    sentences = [
        f"On {count} further recordings of the rig's bands,"
        f" which took part in no choice though their bands did"
        f" ([table 1](#table-1), [data](validation/{FILE.name})),"
        f" launches without errors miss by {', '.join(means)}."]  # fmt: skip
    if changed := repeated.changed_settings(params):
        keys = ", ".join(change.key for change in changed)
        sentences.append(
            f"These recordings were searched with other settings than this run: {keys}."
        )
    sentences += [_claim(repeated, *claim) for claim in CLAIMS.items()]
    return sentences + _why(repeated.ranks)


def _why(ranks: MeanInterval) -> list[str]:
    """What a lower loss of the paper's is worth; nothing where the interval leaves it open."""
    words = f"{ranks.mean:+.2f}, {ranks.low:+.2f} to {ranks.high:+.2f}".replace("-", "−")
    correlation = f"(rank correlation on one recording: {words})"
    if ranks.low > 0:
        return [f"A search that finds a lower loss of the paper's lands nearer {correlation}."]
    if ranks.high < FEW:
        return [
            f"A search that finds a lower loss of the paper's does not land nearer {correlation}:"
            " its minimum lies off the rig's band, so searching better does not help."
        ]
    return []


def _claim(repeated: Repeated, table: int, claim: str) -> str:
    """A finding against every method of its table but ours and those that no one compares."""
    others = [m for m in ROWS[table] if m not in (OURS, paper.METHOD, "no_clamp_calibration")]
    by_verdict: dict[str, list[str]] = {}
    for method in others:
        difference = repeated.against[ALL].get(method)
        if difference is None:
            continue
        name = name_of(method).replace(", ", " with ") if method not in PLAIN else name_of(method)
        words = f"{name} ({difference.mean:+.1f} cm)".replace("-", "−")
        verdict = "is open against"
        if difference.real:
            verdict = "holds against" if difference.mean > 0 else "does not hold against"
        by_verdict.setdefault(verdict, []).append(words)
    parts = [f"{verdict} {'; '.join(names)}" for verdict, names in sorted(by_verdict.items())]
    return f"There, the paper's finding that {claim} {', and '.join(parts)}."


def _mean(interval: MeanInterval) -> str:
    return f"{interval.mean:.1f} cm ({interval.low:.1f} to {interval.high:.1f})"
