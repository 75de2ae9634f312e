"""What would help most next: cures of what speaks against, then what narrows the interval.

That of the middle target's landing, computed from the posterior (gain.py), the largest gain first.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from pipeline.card.gain import LandingModel
from pipeline.card.verdict import Reason
from pipeline.episode.episode import Episode
from pipeline.posterior.launches import TAPE

LEAST = 0.05  # share of an interval: less is no help
MOST = 5  # sentences
LAUNCHES = 5
RELAXING = 0.5  # s before the release in which the force must be still,
STILL = 0.01  # to this share of it
RECOIL = "elasticity_damping", "air_drag", "turn_damping"  # what only pictures of the recoil show
PULL = "youngs_modulus", "mooney_share", "relaxation"  # what the force shows


class Gain(NamedTuple):
    """What to do, and the half width of the interval then [m]."""

    text: str
    width: float


def next_steps(
    band: str, reasons: Sequence[Reason], model: LandingModel | None, targets, episode: Episode
) -> list[str]:
    """Sentences, the most helpful first; one that says so where nothing helps.

    Args:
        targets: Of the landings [m], shape (T,).
    """
    found = list(dict.fromkeys(reason.cure for reason in reasons if reason.cure))
    if model is not None:
        aim = len(targets) // 2
        before = model.half_width[aim]
        steps = [
            one for one in _steps(band, model, aim, episode) if one.width < (1 - LEAST) * before
        ]
        for step in sorted(steps, key=lambda one: one.width):
            found.append(step.text.format(f"{targets[aim]:g} m", _cm(before), _cm(step.width)))
    if not found:
        found.append("Nothing more would narrow the landings by much: launch.")
    return found[:MOST]


def _steps(band: str, model: LandingModel, aim: int, episode: Episode) -> Iterator[Gain]:
    one, more = (model.after(model.launched(aim, TAPE, count))[aim] for count in (1, LAUNCHES))
    several = f"; {LAUNCHES} launches to ±{_cm(more)} cm" if _cm(more) != _cm(one) else ""
    yield Gain(
        f"Measure a launch and tell it with `sling observe --band {band}`: the interval at {{0}}"
        f" narrows from ±{{1}} to ±{{2}} cm{several}.",
        one,
    )
    yield Gain(
        "Record another pull like those that you have: the interval at {0} narrows from ±{1} to"
        " about ±{2} cm.",
        model.after(model.pulled())[aim],
    )
    yield Gain(
        "Record with a faster camera, or pulls whose pictures fall at other moments of the recoil:"
        " with damping and drag known exactly, the interval at {0} would be ±{2} cm instead of"
        " ±{1} cm.",
        model.after(model.exact(RECOIL))[aim],
    )
    if relaxing(episode):
        yield Gain(
            "Pause longer before the release, for the force was still falling: with stiffness and"
            " relaxation known exactly, the interval at {0} would be ±{2} cm instead of ±{1} cm.",
            model.after(model.exact(PULL))[aim],
        )
    yield Gain(
        "Let a more exact arm draw: without an error of the draw, the interval at {0} would be"
        " ±{2} cm instead of ±{1} cm.",
        model.after(draw=0.0)[aim],
    )


def relaxing(episode: Episode) -> bool:
    """Whether the force of the drawn band still fell shortly before the release."""
    before = episode.release_time - episode.time
    size = np.linalg.norm(episode.force, axis=1)
    early, late = (
        size[(before > begin) & (before < begin + RELAXING / 2)].mean()
        for begin in (RELAXING, RELAXING / 4)
    )
    return bool(early - late > STILL * late)


def _cm(width: float) -> str:
    return f"{100 * width:.1f}" if width < 0.095 else f"{100 * width:.0f}"
