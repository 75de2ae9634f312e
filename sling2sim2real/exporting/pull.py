"""A recorded or planned pull in both simulations: force on the hand and centre line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.episode.episode import Episode
from sling2sim2real.exporting.band import CalibratedBand
from sling2sim2real.exporting.mesh import hand_path
from sling2sim2real.exporting.replay import ChainReplay
from sling2sim2real.simulator.interaction import interact


@dataclass(frozen=True)
class PullCompared:
    """What the target's pull leaves of ours while the hand holds.

    Attributes:
        peak: Largest force on the hand of ours [N].
        force_rms, force_largest: Of the difference [N].
        hold: Of the force at the release, relative.
        line_rms, line_largest: Distance of the nodes, over all and of the worst picture [m].
        taut_rms: Over pictures in which the band is taut [m]; None without any.
    """

    peak: float
    force_rms: float
    force_largest: float
    hold: float
    line_rms: float
    line_largest: float
    taut_rms: float | None


def compare_pull(model: CalibratedBand, episode: Episode, replay: ChainReplay) -> PullCompared:
    """Pull as in `episode`, in both. Raises UserError where our simulation fails."""
    ours, chain = interact(model.sling, episode, model.parameters), replay.chain
    if ours.failure[0]:
        raise UserError(f"the pull of {episode.band}: {ours.failure[0]}")
    count = int((episode.release_time - episode.grasp_time) / chain.step)
    times = episode.grasp_time + chain.step * np.arange(1, count + 1)
    stamps = episode.cloud_time
    seen = (stamps > times[0]) & (stamps < times[-1])
    theirs = replay.pull(lambda start: hand_path(episode, times, start), times, stamps[seen])

    held = (ours.times > times[0]) & (ours.times < times[-1])
    force = ours.force[0, held]
    other = _read(ours.times[held], theirs.time, theirs.force)
    off = np.linalg.norm(other - force, axis=1)
    length = np.diff(ours.times[held], prepend=times[0])  # steps are irregular

    arc = np.linspace(0, chain.rest_length, chain.edges + 1)
    lines = np.array([_read(arc, model.sling.arc, line) for line in ours.center_line[0, seen]])
    apart = np.sqrt((np.linalg.norm(theirs.line - lines, axis=2) ** 2).mean(axis=1))
    middle = lines[:, chain.edges // 2, None] - chain.tips
    taut = np.linalg.norm(middle, axis=2).min(axis=1) > chain.rest_length / 2
    return PullCompared(
        peak=float(np.linalg.norm(force, axis=1).max()),
        force_rms=float(np.sqrt((length * off**2).sum() / length.sum())),
        force_largest=float(off.max()),
        hold=float(np.linalg.norm(other[-1]) / np.linalg.norm(force[-1]) - 1),
        line_rms=_rms(apart),
        line_largest=float(apart.max()),
        taut_rms=_rms(apart[taut]) if taut.any() else None,
    )


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt((values**2).mean()))


def _read(at: np.ndarray, places: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Rows (P, 3) at ascending `places` (P,), read at `at` (Q,): shape (Q, 3)."""
    return np.stack([np.interp(at, places, column) for column in rows.T], axis=1)
