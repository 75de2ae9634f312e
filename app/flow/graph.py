"""DVC's graph of stages, and what of it DVC would run."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import reduce
from operator import getitem
from pathlib import Path
from threading import Lock

from pipeline.base.errors import UserError, one_line


@dataclass(frozen=True)
class Stage:
    """One stage of dvc.yaml.

    Attributes:
        name: As DVC calls it: theta@band1-sling2sim2real.
        step: What it does: theta.
        item: For what: band1-sling2sim2real; empty where there is one such stage.
        producers: Names of the stages whose outputs it reads, sorted.
        gpu: Whether it computes where SLING_DEVICE says (`meta: {gpu: true}` in dvc.yaml).
    """

    name: str
    step: str
    item: str
    producers: tuple[str, ...]
    gpu: bool


class Graph:
    """The stages of a working copy, as dvc.yaml, params.yaml and dvc.lock have them now.

    Attributes:
        stages: By name; those with the longest way to go come first, and so each stage comes after
            its producers; then as in dvc.yaml.
    """

    def __init__(self, root: Path) -> None:
        """Raises UserError where DVC cannot read the project, or another DVC is at work."""
        self._one_at_a_time = Lock()
        with _clear():
            import networkx
            from dvc.repo import Repo

            # Its warnings, such as on empty files, come once more from each stage that runs.
            logging.getLogger("dvc").setLevel(logging.ERROR)
            repo = Repo(str(root))
            with repo.lock:  # dvc.lock is rewritten in place
                graph = repo.index.graph  # from consumers to producers
            # data sources, made by `dvc add`, are nodes too
            known = {one: one.name for one in repo.index.stages if one.cmd}
            height: dict = {}
            for node in networkx.topological_sort(graph):
                height[node] = 1 + max((height[one] for one in graph.predecessors(node)), default=0)
            order = sorted(known, key=lambda one: -height[one])
            self._dvc = {known[one]: one for one in order}
            self.stages = {
                known[one]: _stage(one, [known[to] for to in graph.successors(one) if to in known])
                for one in order
            }

    def stale(self) -> list[str]:
        """Stages that DVC would run as things are, and all their consumers, in order."""
        found: set[str] = set()
        seen = Seen()
        for name, stage in self.stages.items():
            if not found.isdisjoint(stage.producers) or not self.is_fresh(name, seen):
                found.add(name)
        return [name for name in self.stages if name in found]

    def is_fresh(self, name: str, seen: Seen | None = None) -> bool:
        """Whether DVC would skip this stage as its files are now. Raises UserError.

        Asks what `dvc repro` asks (Stage.changed in dvc/stage/__init__.py), but takes no lock: the
        files of a stage rest while its producers are done and it does not run. dvc.lock is not
        read again: only the stage itself changes its entry.
        """
        stage, seen = self._dvc[name], seen or Seen()
        with self._one_at_a_time, _clear():
            if stage.changed_stage() or stage.is_callback or stage.always_changed:
                return False
            deps = [] if stage.frozen else stage.deps
            return all(map(seen.same, deps)) and not any(out.status() for out in stage.outs)


class Seen:
    """What DVC found of files a moment ago: a hundred stages hang on the same code and parameters.

    It only ever says that something is as it was; whether it is not is asked of DVC each time.
    """

    def __init__(self) -> None:
        self._hashes: dict = {}
        self._parameters: dict = {}

    def same(self, dep) -> bool:
        """Whether a stage's dependency is as its last run found it."""
        from dvc.dependency import ParamsDependency

        if isinstance(dep, ParamsDependency):
            return self._same_values(dep) or not dep.status()
        if dep.hash_info and self._hashes.get(dep.fs_path) == dep.hash_info:
            return True
        if dep.status():
            return False
        self._hashes[dep.fs_path] = dep.hash_info
        return True

    def _same_values(self, dep) -> bool:
        from dvc.dependency.param import read_param_file

        before = dep.hash_info.value
        if not (before and dep.params):
            return False
        if dep.fs_path not in self._parameters:
            content = read_param_file(dep.repo.fs, dep.fs_path) if dep.exists else {}
            self._parameters[dep.fs_path] = content
        try:
            return all(
                reduce(getitem, key.split("."), self._parameters[dep.fs_path]) == before[key]
                for key in dep.params
            )
        except (KeyError, TypeError, IndexError):
            return False


def _stage(stage, producers: list[str]) -> Stage:
    step, _, item = stage.name.partition("@")
    gpu = bool((stage.meta or {}).get("gpu"))
    return Stage(stage.name, step, item, tuple(sorted(producers)), gpu)


@contextmanager
def _clear() -> Iterator[None]:
    """DVC's errors as one line."""
    from dvc.exceptions import DvcException
    from dvc.lock import LockError

    try:
        yield
    except LockError as error:
        raise UserError(
            "another DVC command is at work in this project; wait for its end, then try again"
            " (if there is none on any machine: rm .dvc/tmp/lock)"
        ) from error
    except DvcException as error:
        raise UserError(f"DVC: {one_line(error)}") from error
