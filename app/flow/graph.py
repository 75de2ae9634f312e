"""DVC's graph of stages, and what of it DVC would run."""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import reduce
from operator import getitem
from pathlib import Path
from threading import Lock

from pipeline.base.errors import UserError, one_line, refused


@dataclass(frozen=True)
class Stage:
    """One stage of dvc.yaml.

    Attributes:
        name: As DVC calls it: theta@band1-sling2sim2real.
        step: What it does: theta.
        item: For what: band1-sling2sim2real; empty where there is one such stage.
        producers: Names of the stages whose outputs it reads, sorted.
        gpu: Whether it computes where SLING_DEVICE says (`meta: {gpu: true}` in dvc.yaml).
        sources: Files and folders that it reads and no stage makes: code, recordings; sorted,
            relative to the root.
        travels: Whether DVC keeps all that it makes, so that a remote can carry it; the report is
            Git's.
        description: In words, `desc` of dvc.yaml up to its first pause.
    """

    name: str
    step: str
    item: str
    producers: tuple[str, ...]
    gpu: bool
    sources: tuple[str, ...] = ()
    travels: bool = True
    description: str = ""


def stages_of(root: Path) -> dict[str, Stage]:
    """The stages of a working copy by name; takes no lock. Raises UserError."""
    from dvc.repo import Repo

    with _clear(), Repo(str(root)) as repo:
        return _stages(repo.index)


def leading_to(stages: Mapping[str, Stage], name: str) -> list[Stage]:
    """A stage and all that it reads from, in the order of `stages`."""
    names = {name}
    for stage in reversed([*stages.values()]):  # consumers first
        if stage.name in names:
            names |= {*stage.producers}
    return [stage for stage in stages.values() if stage.name in names]


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
            from dvc.repo import Repo
            from dvc.stage import PipelineStage

            # Its warnings, such as on empty files, come once more from each stage that runs.
            logging.getLogger("dvc").setLevel(logging.ERROR)
            repo = Repo(str(root))
            with repo.lock:  # dvc.lock is rewritten in place
                self.stages = _stages(repo.index)
            stages = [stage for stage in repo.index.stages if isinstance(stage, PipelineStage)]
            self._dvc = {stage.name: stage for stage in stages if stage.cmd}

    def stale(self) -> list[str]:
        """Stages that DVC would run as things are, and all their consumers, in order."""
        names: set[str] = set()
        seen = Seen()
        for name, stage in self.stages.items():
            if not names.isdisjoint(stage.producers) or not self.is_fresh(name, seen):
                names.add(name)
        return [name for name in self.stages if name in names]

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


def outdated(root: Path, names: Iterable[str], code: tuple[str, ...]) -> dict[str, bool | None]:
    """Whether code or parameters of stages, or of any before them, are others than in dvc.lock.

    Data count for nothing: they may lack in a clone.

    Args:
        names: Of stages.
        code: How paths of code begin, relative to the root.

    Returns:
        By name; None where DVC cannot tell, such as of a band that params.yaml has not.
    """
    from dvc.dependency import ParamsDependency

    try:
        graph = Graph(root)
    except UserError:
        return dict.fromkeys(names)
    seen, states = Seen(), {}

    def changed(name: str) -> bool:
        if name not in states:
            states[name] = any(
                isinstance(dep, ParamsDependency) or _inside(dep, root).startswith(code)
                for dep in graph._dvc[name].deps
                if not seen.same(dep)
            ) or any(map(changed, graph.stages[name].producers))
        return states[name]

    with _clear():
        return {name: changed(name) if name in graph.stages else None for name in names}


def _inside(dep, root: Path) -> str:
    return os.path.relpath(dep.fs_path, root.resolve())


class Seen:
    """What DVC found of files a moment ago: many stages depend on the same code and parameters.

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


def _stages(index) -> dict[str, Stage]:
    """Runnable stages by name, in the order of Graph.stages."""
    import networkx

    graph = index.graph  # from consumers to producers; makes of `dvc add` are nodes too
    runnable, height = [stage for stage in index.stages if stage.cmd], {}
    for node in networkx.topological_sort(graph):
        height[node] = 1 + max(
            (height[predecessor] for predecessor in graph.predecessors(node)), default=0
        )
    runnable.sort(key=lambda stage: -height[stage])
    return {
        stage.name: _stage(stage, [to for to in graph.successors(stage) if to.cmd])
        for stage in runnable
    }


def _stage(stage, producers: list) -> Stage:
    """A stage of DVC's, whose producers are stages of DVC's."""
    from dvc.dependency import ParamsDependency

    step, _, item = stage.name.partition("@")
    made = [Path(out.fs_path) for producer in producers for out in producer.outs]
    read = (Path(dep.fs_path) for dep in stage.deps if not isinstance(dep, ParamsDependency))
    sources = (
        os.path.relpath(path, stage.repo.root_dir)
        for path in read
        if not any(path.is_relative_to(out) or out.is_relative_to(path) for out in made)
    )
    return Stage(
        stage.name,
        step,
        item,
        producers=tuple(sorted(producer.name for producer in producers)),
        gpu=bool((stage.meta or {}).get("gpu")),
        sources=tuple(sorted(sources)),
        travels=all(out.use_cache for out in stage.outs),
        description=re.split("[,;:]", stage.desc or "")[0],
    )


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
    except OSError as error:
        if not (line := refused(error)):
            raise
        raise UserError(line) from error
