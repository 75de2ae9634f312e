"""E and damping of a band over its recordings, in one picture."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter, date2num
from matplotlib.figure import Figure

from app.drift.change import ChangeOfBand
from app.drift.recordings import COMPARED, IdentifiedRecording
from pipeline.report.drawing.canvas import key, mark, picture
from pipeline.report.drawing.names import as_label
from pipeline.report.drawing.styles import INK, KNOWN
from pipeline.report.quantities import QUANTITIES

CROWDED = 0.01  # of the whole time: recordings nearer than that would lie on one another
NAMED = 8  # recordings that find room for their names
LINE = 75  # letters side by side
NEW, LEFT_OUT = KNOWN["least_squares"][1], "0.65"


@picture(dpi=130)
def over_time(
    recordings: Sequence[IdentifiedRecording],
    dated: bool,
    changed: Sequence[ChangeOfBand],
    new: int,
    title: str,
) -> Figure:
    """A panel for each quantity, with 90 % intervals.

    Args:
        dated: Whether the stamps tell the time.
        changed: Surest first; the first of each quantity is drawn.
        new: From which recording on the band is as it is now; 0: it is as it was.
        title: What came out.
    """
    places, true_times = _places(recordings, dated)
    figure, axes = plt.subplots(len(COMPARED), 1, figsize=(8.4, 5.2), sharex=True)
    for ax, name in zip(axes, COMPARED, strict=True):
        factor = QUANTITIES[name].factor
        for number, (place, recording) in enumerate(zip(places, recordings, strict=True)):
            value = recording.values[name]
            ends = factor * np.array([[value.value - value.low], [value.high - value.value]])
            color = LEFT_OUT if not recording.settled else NEW if new and number >= new else INK
            style = {"fmt": "o", "color": color, "ms": 5, "capsize": 4, "lw": 1.6}
            ax.errorbar(place, factor * value.value, ends, **style)
        if change := next((candidate for candidate in changed if candidate.quantity == name), None):
            numbers = [change.earlier, change.later]
            ends = [factor * recordings[number].values[name].value for number in numbers]
            ax.plot([places[number] for number in numbers], ends, color=NEW, lw=1, ls=":")
            middle = np.mean([places[number] for number in numbers]), np.mean(ends)
            label = f"{100 * (change.ratio - 1):+.0f} %"
            label_style = {"xytext": (6, 6), "textcoords": "offset points", "color": NEW}
            ax.annotate(label, middle, weight="bold", **label_style)
        ax.set_ylabel(QUANTITIES[name].heading)
        ax.margins(x=0.08, y=0.15)
    last = axes[-1]
    if true_times:
        locator = AutoDateLocator(maxticks=NAMED)
        last.xaxis.set_major_locator(locator)
        last.xaxis.set_major_formatter(ConciseDateFormatter(locator))
    else:
        shown = range(0, len(recordings), -(-len(recordings) // NAMED))
        names = [
            recordings[i].date.removesuffix(" UTC") if dated else recordings[i].file for i in shown
        ]
        last.set_xticks([places[i] for i in shown], map(as_label, names))
        if sum(map(len, names)) > LINE:
            last.tick_params(axis="x", rotation=30)
    last.set_xlabel("time of the recording (UTC)" if dated else "recording, by its file's name")
    figure.suptitle(title, fontsize=11, fontweight="bold")
    style = {"marker": "o", "ls": "-", "lw": 1.6, "ms": 5}
    entries = [("one recording alone, 90 % interval", mark(color=INK, **style))]
    if new:
        entries.append(("as the band is now", mark(color=NEW, **style)))
    if not all(recording.settled for recording in recordings):
        entries.append(("not settled, left out", mark(color=LEFT_OUT, **style)))
    key(figure, entries)
    return figure


def _places(recordings: Sequence[IdentifiedRecording], dated: bool) -> tuple[list[float], bool]:
    """Along the axis, and whether they are dates: else recordings stand evenly, in order."""
    times = date2num(
        [datetime.fromtimestamp(recording.begin / 1e9, UTC) for recording in recordings]
    )
    if dated and np.diff(times).min() > CROWDED * np.ptp(times):
        return times.tolist(), True
    return [float(number) for number in range(len(recordings))], False
