"""A search that is killed goes on to the same result; what was simulated is recalled."""

import re
import signal
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pipeline.base.code import closure
from pipeline.base.fingerprint import fingerprint
from pipeline.identify.objective.cache import EvaluationCache
from pipeline.identify.objective.evaluate import NOT_FINITE, Evaluation, Evaluator
from pipeline.identify.objective.loss import TERMS
from pipeline.identify.objective.session import SOURCES
from pipeline.simulator.parameters import THETA
from tests.forked import Forked
from tests.identify.search import toy
from tests.identify.search.functions import NAMES, Evaluate, quadratic
from tests.identify.search.killed import ROLLOUTS, VALLEY, searched
from tests.project import ROOT, python


@pytest.fixture(scope="module")
def run() -> Iterator[Forked]:
    with Forked("tests.identify.search.killed", "torch") as run:
        yield run


@pytest.mark.parametrize(
    ("name", "batches", "kills"),
    [
        ("multistart", 13 + 8, (5, 10)),  # in the exploration, and in the refinement
        ("de", -(-ROLLOUTS // 24), (4,)),
        ("bo", -(-ROLLOUTS // 24), (4,)),
        ("adam", 1 + -(-(ROLLOUTS - 24) // 24), (4,)),
        ("tests.identify.search.own:RandomSearch", -(-ROLLOUTS // 7), (4,)),
    ],
)
def test_sigkill_and_on_to_the_same_bytes(
    tmp_path: Path, run: Forked, name: str, batches: int, kills: tuple[int, ...]
) -> None:
    """Nothing is evaluated twice."""
    (tmp_path / "parts").mkdir()
    arguments = name, str(tmp_path / "two"), str(tmp_path / "parts")
    inner = Evaluate(VALLEY)
    whole = searched(name, inner)
    assert inner.count == batches
    for fatal in kills:
        killed = run(*arguments, str(fatal))
        assert killed.returncode == -signal.SIGKILL, killed.message
        assert not list((tmp_path / "parts").iterdir())
    last = run(*arguments, str(10**6))
    assert last.returncode == 0, last.message
    assert int(last.message.splitlines()[-1]) == batches - sum(kills)
    for number, history in enumerate(whole):
        history.save(tmp_path / "whole.parquet")
        left = tmp_path / "parts" / f"{number}.parquet"
        assert left.read_bytes() == (tmp_path / "whole.parquet").read_bytes()


def bowl(**more) -> Evaluate:
    """A tenth of it fails."""
    return quadratic(np.zeros(2), np.eye(2), names=NAMES[:2], **more)


def batches(*firsts: float) -> list[np.ndarray]:
    return [np.array([[first, 0.5], [0.95, 0.1]]) for first in firsts]


def fails(unit: np.ndarray) -> np.ndarray:
    return unit[:, 0] > 0.9


@pytest.fixture
def remembered(tmp_path: Path):
    """Opens the same memory again for batches: how many were really evaluated, and what came."""

    def evaluate(units: list[np.ndarray], stamp: str = "x", **more) -> tuple[int, list[Evaluation]]:
        inner = bowl(fails=fails, **more)
        cache = EvaluationCache(inner, tmp_path / "memory", stamp)
        evaluations = [cache(unit) for unit in units]
        return inner.count, evaluations

    return evaluate


def test_what_was_simulated_is_recalled(remembered) -> None:
    """In any order, with the same content, and marked as recalled by its time."""
    count, first = remembered(batches(0.1, 0.2))
    assert count == 2
    count, again = remembered(batches(0.3, 0.2, 0.1))
    assert count == 1
    for evaluation, other in zip(first, again[:0:-1], strict=True):
        for name in ("unit", "theta", "total"):
            np.testing.assert_array_equal(getattr(evaluation, name), getattr(other, name))
        assert evaluation.failure == other.failure == [None, "no"]
        np.testing.assert_array_equal(evaluation.terms["geom"], other.terms["geom"])
        assert (evaluation.seconds, other.seconds) == (1.0, 0.0)


def test_totals_are_recomputed_by_weights(remembered) -> None:
    _, (plain,) = remembered(batches(0.1))
    count, (heavy,) = remembered(batches(0.1), weights={"geom": 2.0, "force": 3.0})
    assert count == 0 and heavy.failure == [None, "no"]
    np.testing.assert_allclose(heavy.total, 5 * plain.total, rtol=1e-15)


def test_other_inputs_start_over_and_replace_the_old(remembered, tmp_path: Path) -> None:
    remembered(batches(0.1, 0.2))
    assert [remembered(batches(0.1, 0.2), "y")[0] for _ in range(2)] == [2, 0]
    assert [folder.name for folder in (tmp_path / "memory").iterdir()] == ["y"]


def test_a_truncated_batch_is_evaluated_again(remembered, tmp_path: Path, capsys) -> None:
    remembered(batches(0.1, 0.2))
    damaged = next((tmp_path / "memory" / "x").iterdir())
    damaged.write_bytes(damaged.read_bytes()[:200])
    assert [remembered(batches(0.1, 0.2))[0] for _ in range(2)] == [1, 0]
    assert capsys.readouterr().err.startswith(f"note: {damaged}: damaged (")


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(place=st.integers(0, 1500), flip=st.integers(1, 255), length=st.integers(1, 40))
def test_a_damaged_batch_never_gives_other_losses(
    remembered, tmp_path: Path, place: int, flip: int, length: int
) -> None:
    """Wherever its bytes are damaged, headers of the archive included: recalled right or not."""
    _, (expected,) = remembered(batches(0.1))
    file = next((tmp_path / "memory" / "x").iterdir())
    whole = bytearray(file.read_bytes())
    for byte in range(place, min(place + length, len(whole))):
        whole[byte] ^= flip
    file.write_bytes(whole)
    _, (evaluation,) = remembered(batches(0.1))
    np.testing.assert_array_equal(evaluation.total, expected.total)
    assert evaluation.failure == expected.failure


def test_a_memory_that_another_run_throws_away_stops_nobody(
    remembered, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another run of the band began with other inputs while this one wrote a batch."""
    written = np.savez

    def interrupted(file, **arrays) -> None:
        written(file, **arrays)
        remembered([], "y")

    monkeypatch.setattr(np, "savez", interrupted)
    count, evaluations = remembered(batches(0.1, 0.2))
    assert (count, len(evaluations)) == (2, 2)
    monkeypatch.undo()
    assert remembered(batches(0.1, 0.2))[0] == 2


def test_runs_side_by_side_share_a_memory(remembered, tmp_path: Path) -> None:
    """None sees a batch that another has half written."""
    firsts = [batches(*np.random.default_rng(seed).permutation(20) / 50) for seed in range(4)]
    with ThreadPoolExecutor(4) as pool:
        runs = list(pool.map(remembered, firsts))
    for units, (_, evaluations) in zip(firsts, runs, strict=True):
        for unit, evaluation in zip(units, evaluations, strict=True):
            np.testing.assert_array_equal(evaluation.total, bowl(fails=fails)(unit).total)
    assert len(list((tmp_path / "memory" / "x").iterdir())) == 20


def test_a_full_disk_is_said_in_one_line(tmp_path: Path) -> None:
    """A limit on the size of files stands for the disk."""
    code = """
import resource
from pathlib import Path
from pipeline.base import errors
from pipeline.identify.objective.cache import EvaluationCache
from tests.identify.objective.test_cache import batches, bowl
resource.setrlimit(resource.RLIMIT_FSIZE, (500, 500))
errors.run(lambda: EvaluationCache(bowl(), Path("memory"), "x")(batches(0.1)[0]) and None)
"""
    done = python("-c", code, folder=tmp_path)
    message = r"error: memory/x/\w+\.npz: cannot be written \(File too large\)\n"
    assert re.fullmatch(message, done.stderr)
    assert done.returncode == 1
    assert not list((tmp_path / "memory" / "x").iterdir())


class Loss:
    """Terms of toy rollouts, one of which, work, is infinite for every other rollout."""

    def __init__(self, **weights: float) -> None:
        self.weights = dict.fromkeys(TERMS, 0.0) | weights

    def terms(self, rollouts) -> dict[str, np.ndarray]:
        value = rollouts.force[:, 0, 0]
        odd = np.arange(len(value)) % 2 == 1
        return {name: np.where(odd & (name == "work"), np.inf, value) for name in self.weights}

    def total(self, terms: dict[str, np.ndarray]) -> np.ndarray:
        return sum(weight * terms[name] for name, weight in self.weights.items() if weight)


def test_a_loss_that_is_not_finite_is_so_by_the_weights(tmp_path: Path) -> None:
    """Whichever method came first, each finds what the evaluator itself says under its weights."""
    episode = toy.episode(frames=1)

    def simulate(sling, episode, parameters, device):
        return toy.rollouts(episode, len(parameters), force=(2.0, 0, 0))

    unit = np.linspace(0, 1, 4)[:, None] * np.ones(5)
    box = Evaluate(np.sum, names=THETA).box
    for folder, names in (("a", ("geom", "work", "geom")), ("b", ("work", "geom", "work"))):
        for name in names:
            inner = Evaluator(episode, toy.SLING, Loss(**{name: 1.0}), box, simulate=simulate)
            expected, evaluation = inner(unit), EvaluationCache(inner, tmp_path / folder, "x")(unit)
            assert evaluation.failure == expected.failure
            assert (NOT_FINITE in evaluation.failure) == (name == "work")
            np.testing.assert_array_equal(evaluation.total, expected.total)
            for term in expected.terms:
                np.testing.assert_array_equal(evaluation.terms[term], expected.terms[term])


def test_the_fingerprint_covers_contents_and_sources(tmp_path: Path) -> None:
    data, source = tmp_path / "data.parquet", tmp_path / "code" / "solver.h"
    source.parent.mkdir()
    data.write_text("1"), source.write_text("2")
    parts = (data, source.parent)
    stamps = [fingerprint("params", *parts), fingerprint("params", *parts)]
    assert stamps[0] == stamps.pop()
    stamps.append(fingerprint("other", *parts))
    for file in (data, source):
        file.write_text(file.read_text() + "3")
        stamps.append(fingerprint("params", *parts))
    assert len(set(stamps)) == 4


def test_the_memory_forgets_when_any_code_of_the_loss_changes() -> None:
    """Every file that the evaluator runs is part of the fingerprint, and nothing of a search."""
    part = {
        file.relative_to(ROOT).as_posix()
        for source in SOURCES
        for file in ([source] if source.is_file() else source.iterdir())
    }
    runs = set(closure(ROOT / "pipeline/identify/objective/evaluate.py"))
    runs -= set(closure(ROOT / "pipeline/params/__init__.py"))  # its values count themselves
    others = ("__init__.py", "base/files.py", "base/home.py", "base/layout.py")
    runs = {file for file in runs if not file.endswith(others)}
    assert runs <= part
    assert not {file for file in part if "search" in file or "optimizers" in file}
