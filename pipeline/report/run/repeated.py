"""The committed campaign of ablations and baselines: ten recordings of each band of the rig.

What it is and how it is made: validation/campaigns/ablations.py. It is no part of a run.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.params import Params
from pipeline.params.provenance import Change, changes, flat
from pipeline.report.run.committed import FOLDER, committed

FILE, WRITER = FOLDER / "ablations.json", "validation.campaigns.ablations"
ALL = "all"  # the bands together
LEVEL = 0.05  # of the corrected p below which a difference counts


@dataclass(frozen=True)
class MeanInterval:
    """A mean over `count` recordings, with its 95 % interval."""

    mean: float
    low: float
    high: float
    count: int


@dataclass(frozen=True)
class Against:
    """Distance by which a method misses more than the paper's on the same recordings [cm].

    Attributes:
        p: Of Wilcoxon's signed-rank test, with Holm's correction.
    """

    mean: float
    low: float
    high: float
    p: float

    @property
    def real(self) -> bool:
        return self.p < LEVEL


@dataclass(frozen=True)
class Repeated:
    """What came of the campaign.

    Attributes:
        miss: Mean distance from the target [cm] by band (or ALL) and method.
        against: The same beside the paper's method.
        ranks: Rank correlation of loss and miss on one recording, over searches of one loss.
        settings: What the campaign ran with, by its keys in params.yaml.
    """

    miss: dict[str, dict[str, MeanInterval]]
    against: dict[str, dict[str, Against]]
    ranks: MeanInterval
    settings: dict[str, Any]

    @classmethod
    def load(cls, root: Path) -> Repeated | None:
        """None where there is no such file. Raises UserError where it is another's."""
        return committed(root / FILE, WRITER, cls._of)

    @classmethod
    def _of(cls, content: dict) -> Repeated:
        figures, paper = content["figures"], "less_sling2sim2real"
        return cls(
            {band: _intervals(figure["methods"]) for band, figure in figures.items()},
            {band: _differences(figure[paper]) for band, figure in figures.items()},
            _interval(content["rank_correlation_of_loss_and_miss"]["over_recordings"]),
            _settings(content["settings"]),
        )

    def changed_settings(self, params: Params) -> list[Change]:
        """Where a run has other settings than the campaign: its numbers are not of this run."""
        now = {
            "trials.targets": [*params.trials.targets],
            **flat("optimizer", params.optimizer),
            **{
                key: value
                for name, method in params.methods.items()
                for key, value in flat(f"methods.{name}", method).items()
            },
        }
        then = {key: value for key, value in self.settings.items() if key in now}
        return changes(then, {key: now[key] for key in then})

    @property
    def bands(self) -> list[str]:
        return sorted(band for band in self.miss if band != ALL)


def _settings(settings: dict) -> dict[str, Any]:
    parts = {name: settings[name] for name in ("optimizer", "methods")}
    return {"trials.targets": settings["targets_m"]} | {
        key: value for name, part in parts.items() for key, value in flat(name, part).items()
    }


def _intervals(methods: dict) -> dict[str, MeanInterval]:
    """Mean misses of the methods that have a mean, with intervals."""
    return {
        name: _interval(of_method["miss_cm"])
        for name, of_method in methods.items()
        if of_method["miss_cm"]["n"]
    }


def _interval(content: dict) -> MeanInterval:
    return MeanInterval(*(content[key] for key in ("mean", "low", "high", "n")))


def _differences(methods: dict) -> dict[str, Against]:
    return {
        name: Against(*(content[key] for key in ("mean", "low", "high", "p_holm")))
        for name, content in methods.items()
        if content["n"]
    }
