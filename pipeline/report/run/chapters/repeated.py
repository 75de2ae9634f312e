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
    known = [f"**{name_of(m)}** {_mean(misses[m])}" for m in (OURS, paper.METHOD) if m in misses]
    count = max(one.count for one in misses.values())
    sentences = [
        f"On {count} further recordings of the rig's bands,"
        f" which took part in no choice though their bands did"
        f" ([table 1](#table-1), [data](validation/{FILE.name})),"
        f" launches without errors miss by {', '.join(known)}."]  # fmt: skip
    if changed := repeated.changed_settings(params):
        keys = ", ".join(one.key for one in changed)
        sentences.append(
            f"These recordings were searched with other settings than this run: {keys}."
        )
    sentences += [_claim(repeated, *claim) for claim in CLAIMS.items()]
    return sentences + _why(repeated.ranks)


def _why(ranks: MeanInterval) -> list[str]:
    """What a lower loss of the paper's is worth; nothing where the interval leaves it open."""
    words = f"{ranks.mean:+.2f}, {ranks.low:+.2f} to {ranks.high:+.2f}".replace("-", "−")
    about = f"(rank correlation on one recording: {words})"
    if ranks.low > 0:
        return [f"A search that finds a lower loss of the paper's lands nearer {about}."]
    if ranks.high < FEW:
        return [
            f"A search that finds a lower loss of the paper's does not land nearer {about}: its"
            " minimum lies off the rig's band, so searching better does not help."
        ]
    return []


def _claim(repeated: Repeated, table: int, claim: str) -> str:
    """A finding against every method of its table but ours and those that no one compares."""
    others = [m for m in ROWS[table] if m not in (OURS, paper.METHOD, "no_clamp_calibration")]
    found: dict[str, list[str]] = {}
    for method in others:
        one = repeated.against[ALL].get(method)
        if one is None:
            continue
        name = name_of(method).replace(", ", " with ") if method not in PLAIN else name_of(method)
        words = f"{name} ({one.mean:+.1f} cm)".replace("-", "−")
        verdict = "is open against"
        if one.real:
            verdict = "holds against" if one.mean > 0 else "does not hold against"
        found.setdefault(verdict, []).append(words)
    parts = [f"{verdict} {'; '.join(names)}" for verdict, names in sorted(found.items())]
    return f"There, the paper's finding that {claim} {', and '.join(parts)}."


def _mean(one: MeanInterval) -> str:
    return f"{one.mean:.1f} cm ({one.low:.1f} to {one.high:.1f})"
