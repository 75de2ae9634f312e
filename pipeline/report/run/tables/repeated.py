"""Tables of the campaign on ten recordings a band, beside those of one run."""

from __future__ import annotations

from pipeline.report.drawing.styles import styles
from pipeline.report.run import paper
from pipeline.report.run.repeated import ALL, Against, MeanInterval, Repeated
from pipeline.report.run.tables.benchmark import band_name
from pipeline.report.run.tables.cells import NONE, Table

PLAIN = {  # variants that no run has, and what they are called
    "no_covariance_plain": "−c, a ball of radius 1",
    "no_covariance_no_multistart_plain": "−c, −m, a ball of radius 1",
    "plain_bo": "BO_L, batches of 4, all points",
    "plain_adam": "Adam_L, one start",
    "no_clamp_calibration": "no clamp calibration",
}
ROWS = {  # by the number of the paper's table
    1: ("real2sim2real", "package_si", "sling2sim2real", "least_squares"),
    3: ("de", "bo", "plain_bo", "adam", "plain_adam", "sling2sim2real"),
    4: (
        "no_covariance_no_multistart",
        "no_covariance_no_multistart_plain",
        "no_multistart",
        "no_covariance",
        "no_covariance_plain",
        "no_work",
        "no_clamp_calibration",
        "sling2sim2real",
    ),
}


def as_table(repeated: Repeated, count: int) -> Table:
    """Mean distance [cm] and its interval by band; the difference to the paper's method."""
    lines = []
    for method in ROWS[count]:
        if method not in repeated.miss[ALL]:
            continue
        cells = [_mean(repeated.miss[band].get(method)) for band in [*repeated.bands, ALL]]
        against = repeated.against[ALL].get(method)
        lines.append([name_of(method), *cells, difference(against), _p(against)])
    beside = f"beside {name_of(paper.METHOD)}"
    return ["method", *map(band_name, repeated.bands), "all", beside, "p"], lines


def name_of(method: str) -> str:
    return PLAIN.get(method) or styles([method])[method].name


def difference(against: Against | None) -> str:
    """Write a difference as in "+3.2 (+1.1 to +5.0)", bold where it counts."""
    if against is None:
        return NONE
    text = f"{against.mean:+.1f} ({against.low:+.1f} to {against.high:+.1f})".replace("-", "−")
    return f"**{text}**" if against.real else text


def _mean(interval: MeanInterval | None) -> str:
    if interval is None:
        return NONE
    return f"{interval.mean:.1f} ({interval.low:.1f} to {interval.high:.1f})"


def _p(against: Against | None) -> str:
    if against is None:
        return NONE
    return "< 0.001" if against.p < 0.001 else f"{against.p:.2g}"
