"""The proof of a matched chain: what its replay leaves of the calibrated simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sling2sim2real.exporting.band import CalibratedBand
from sling2sim2real.exporting.chain import SpringChain
from sling2sim2real.exporting.match import DrawCompared, compared, draws_of, within_limits
from sling2sim2real.exporting.replay import ChainReplay


@dataclass(frozen=True)
class Matched:
    """What the match and the proof came to.

    Attributes:
        chain: Matched.
        match: Draws that it was matched to.
        proof: Draws that it was not, flown to the floor.
        finer: Largest relative change of the proof's landings with half the time step.
        engine: Name and version.
    """

    chain: SpringChain
    match: Sequence[DrawCompared]
    proof: Sequence[DrawCompared]
    finer: float
    engine: str

    @property
    def met(self) -> bool:
        return within_limits(self.proof)


def proven(model: CalibratedBand, replay: ChainReplay, proof: np.ndarray) -> Matched:
    """Launch the match's draws and those of `proof` (N, 2)."""
    (draws, _), shots = draws_of(model), replay.launches(proof, fly=True)
    finer = replay.finer.launches(proof)
    moved = [half.landing / shot.landing - 1 for half, shot in zip(finer, shots, strict=True)]
    return Matched(
        chain=replay.chain,
        match=compared(model, draws, replay.launches(draws)),
        proof=compared(model, proof, shots),
        finer=max(map(abs, moved)),
        engine=replay.engine,
    )
