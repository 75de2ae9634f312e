"""What would help most next: cures of what speaks against, then what narrows the interval.

That of the middle target's landing, by identification/posterior/gain.py, the largest gain first.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from sling2sim2real.card.verdict import Reason
from sling2sim2real.episode.episode import Episode
from sling2sim2real.episode.phases import TURN
from sling2sim2real.identification.posterior.gain import LandingModel
from sling2sim2real.identification.posterior.launches import TAPE

LEAST = 0.05  # share of an interval: less is no help
# To which a dip of 5 to 15 cm tells the softening, where E, the curve's shape, relaxation, and the
# force's bias, drift, gain and clock are unknown beside it: linear, with 0.11 N a sample, without
# flow. Beside flow it shows the softening less surely, so that the gain is a little too large.
DIP = "softening", 0.01
MOST = 5  # sentences
LAUNCHES = 5
EARLY, LATE = (0.75, 0.5), (0.4, 0.15)  # s before the release, between which the force must be
STILL = 0.01  # still to this share of it
RECOIL = "elasticity_damping", "air_drag", "turn_damping"  # what only pictures of the recoil show
PULL = "youngs_modulus", "mooney_share", "relaxation"  # what the force shows
A_DIP = "Record a pull with dips (`sling plan` writes it): it shows how the band unloads"


class Gain(NamedTuple):
    """What to do, and the half width of the interval then [m]."""

    text: str
    width: float


def next_steps(
    reasons: Sequence[Reason],
    model: LandingModel | None,
    targets: np.ndarray,
    episodes: Sequence[Episode],
    launches: int = 0,
    question: str = "",
    *,
    unloaded: bool = True,
) -> list[str]:
    """Sentences, the most helpful first; one that says so where nothing helps.

    Args:
        reasons: Causes first, as `judge` has them: their cures come in this order.
        targets: Of the landings [m], shape (T,).
        episodes, launches: Pulls, and the number of launches, that are evidence already.
        question: About the band's mass and size; comes first.
        unloaded: Whether any pull shows how the band unloads.
    """
    cures = [question, *(reason.cure for reason in reasons)]
    steps = list(dict.fromkeys(filter(None, cures)))
    mended_first = any(reason.against and reason.cure for reason in reasons)
    if not (unloaded or launches or mended_first or (model and DIP[0] in model.names)):
        steps.append(f"{A_DIP}, which a launch depends on.")
    if model is not None and not mended_first:
        aim = len(targets) // 2
        before = model.half_width[aim]
        words = {"a": "another" if launches else "a"}
        words["narrows"] = f"the interval at {targets[aim]:g} m narrows from {_cm(before)}"
        gains = _gains(model, aim, episodes, unloaded)
        for gain in sorted(gains, key=lambda gain: gain.width):
            if gain.width < (1 - LEAST) * before:
                steps.append(gain.text.format(**words, after=f"{_cm(gain.width)} cm"))
    if not steps:
        steps.append("No further measurement would narrow the landings by much: launch.")
    return steps[:MOST]


def _gains(
    model: LandingModel, aim: int, episodes: Sequence[Episode], unloaded: bool
) -> Iterator[Gain]:
    single, more = (model.after(model.launched(aim, TAPE, count))[aim] for count in (1, LAUNCHES))
    yield Gain(
        "Measure {a} launch and add it with `sling observe`: {narrows} to {after}, with"
        f" {LAUNCHES} launches to {_cm(more)} cm.",
        single,
    )
    if not unloaded and DIP[0] in model.names:
        yield Gain(
            f"{A_DIP}: {{narrows}} to about {{after}}.",
            model.after(model.known(DIP[0], spread=DIP[1]))[aim],
        )
    yield Gain(
        "Record more pictures of the recoil, by a faster camera or by more pulls. With damping and"
        " drag known exactly, {narrows} to {after}.",
        model.after(model.known(*RECOIL))[aim],
    )
    if any(map(relaxing, episodes)):
        yield Gain(
            "Pause longer before the release, because the force was still falling. With stiffness"
            " and relaxation known exactly, {narrows} to {after}.",
            model.after(model.known(*PULL))[aim],
        )
    yield Gain(
        "Position the hand more exactly: without any error of the draw, {narrows} to {after}.",
        model.after(draw=0.0)[aim],
    )


def relaxing(episode: Episode) -> bool:
    """Whether the force of the drawn band still fell shortly before the release."""
    before = episode.release_time - episode.time
    size = np.linalg.norm(episode.force, axis=1)
    away = np.linalg.norm(episode.position - episode.position[before > 0][-1], axis=1)
    windows = [(before < begin) & (before > end) for begin, end in (EARLY, LATE)]
    if any(not window.any() or away[window].max() > TURN for window in windows):
        return False  # the hand draws, or comes back from a dip
    early, late = (size[window].mean() for window in windows)
    return bool(early - late > STILL * late)


def _cm(half_width: float) -> str:
    """A whole width."""
    width = 2 * half_width
    return f"{100 * width:.1f}" if width < 0.095 else f"{100 * width:.0f}"
