"""What every chapter, picture and page of the report is made from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.params import Params
from pipeline.policy.aim import ROBUST, policy_draws
from pipeline.report.looks import Look
from pipeline.report.replay import Replay
from pipeline.report.results import Results


@dataclass(frozen=True)
class Report:
    """All that ran, as it is shown.

    Attributes:
        replays: By band and method; of the methods that are drawn.
        looks: By method.
        root: Of the project, with data/ and reports/.
    """

    params: Params
    results: Results
    replays: dict[str, dict[str, Replay]]
    looks: dict[str, Look]
    root: Path

    @property
    def folder(self) -> Path:
        return self.root / "reports"

    def draws(
        self, band: str, method: str, targets: np.ndarray, *, robust: bool = False
    ) -> np.ndarray:
        """Draws (N, 2) [m] for targets (N,) [m] of a method's plain or robust policy."""
        folder = self.root / "data" / "policies" / band / method
        return policy_draws(self.params.run, folder / ROBUST if robust else folder, targets)
