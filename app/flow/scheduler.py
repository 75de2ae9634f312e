"""Which stage is next, and what became of the others."""

from __future__ import annotations

from dataclasses import dataclass, field

from app.flow.graph import Stage
from pipeline.base.errors import UserError


@dataclass
class Scheduler:
    """Which stage is next, and what became of the others. Knows nothing of how they run.

    Attributes:
        waiting: Stages that have not begun, in order.
        workers: Stages at a time.
        shares: What of the environment each GPU stage gets that runs; None: as many as like.
    """

    waiting: list[Stage]
    workers: int
    shares: list[dict[str, str]] | None = None
    running: dict[str, dict[str, str]] = field(default_factory=dict)
    ran: list[str] = field(default_factory=list)
    fresh: list[str] = field(default_factory=list)
    failed: dict[str, UserError] = field(default_factory=dict)
    not_run: list[str] = field(default_factory=list)

    def next(self) -> tuple[Stage, dict[str, str]] | None:
        """The first stage that can begin now, with its share; None if none can."""
        self._follow_failures()
        if len(self.running) >= self.workers:
            return None
        open_ones = {waiting_stage.name for waiting_stage in self.waiting} | self.running.keys()
        for stage in self.waiting:
            shares = self.shares if stage.gpu else None
            if open_ones.isdisjoint(stage.producers) and shares != []:
                self.waiting.remove(stage)
                share = shares.pop(0) if shares else {}
                self.running[stage.name] = share
                return stage, share
        return None

    def done(self, stage: Stage, outcome: bool | UserError) -> None:
        """A stage has ended: it ran (True), was fresh (False), or failed."""
        share = self.running.pop(stage.name)
        if stage.gpu and self.shares is not None:
            self.shares.append(share)
        if isinstance(outcome, UserError):
            self.failed[stage.name] = outcome
        else:
            (self.ran if outcome else self.fresh).append(stage.name)

    def stop(self) -> None:
        """Nothing more begins."""
        self.not_run += [stage.name for stage in self.waiting]
        self.waiting.clear()

    def _follow_failures(self) -> None:
        """What follows from a failure does not run."""
        for stage in list(self.waiting):  # producers come first
            if not {*self.failed, *self.not_run}.isdisjoint(stage.producers):
                self.waiting.remove(stage)
                self.not_run.append(stage.name)

    def summary(self) -> str:
        counts = {
            "ran": self.ran,
            "fresh after all": self.fresh,
            "failed": self.failed,
            "not run": self.not_run,
        }
        return "stages: " + ", ".join(f"{len(some)} {what}" for what, some in counts.items())


def width(stages: list[Stage]) -> int:
    """How many stages can run at once: the most that lie as far from the beginning."""
    depth: dict[str, int] = {}
    for stage in stages:
        depth[stage.name] = 1 + max(
            (depth.get(producer, 0) for producer in stage.producers), default=0
        )
    levels = list(depth.values())
    return max(map(levels.count, levels))
