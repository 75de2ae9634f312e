"""What becomes of stages that fail and of an interrupt; of real stages: test_run.py."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from app.flow import child
from app.flow.graph import Stage
from app.flow.log import RunLog
from app.flow.scheduler import Scheduler
from app.flow.tasks import Tasks, perform
from pipeline.base.errors import UserError
from tests.app.flow.test_log import without_time

ONE, TWO = Stage("one", "one", "", (), False), Stage("two", "two", "", ("one",), False)
GRAPH = SimpleNamespace(is_fresh=lambda name: False)


def performed(root: Path, place) -> Scheduler:
    """Both stages, run by `place`."""
    scheduler = Scheduler([ONE, TWO], 2)
    with RunLog(root, "sling flow", ["one", "two"]) as log:
        perform(scheduler, Tasks(root, GRAPH, {}, place, log))  # pyright: ignore[reportArgumentType]
    return scheduler


def ended(root: Path) -> dict[str, str]:
    """States by stage, and of the run."""
    events = without_time(root)
    return {
        event.get("stage", "run"): event["state"] for event in events if event["what"] == "ended"
    }


def test_what_ran_and_what_came_from_the_cache(tmp_path: Path) -> None:
    done = performed(tmp_path, lambda root, name, **_: name == "one")
    assert (done.ran, done.fresh) == (["one"], ["two"])
    assert ended(tmp_path) == {"one": "ran", "two": "cached", "run": "ran"}


def test_a_fault_of_ours_is_a_failed_stage_in_one_line(tmp_path: Path) -> None:
    for error, line in (
        (RuntimeError("no\nmore"), "one: RuntimeError: no more"),
        (child.StageFailed("one: says bad"), "one: says bad"),
    ):

        def place(*_, error: Exception = error, **__) -> bool:
            raise error

        done = performed(tmp_path / type(error).__name__, place)
        assert isinstance(done.failed["one"], UserError) and str(done.failed["one"]) == line
        assert done.not_run == ["two"]
        assert ended(tmp_path / type(error).__name__)["one"] == "failed"


def test_an_interrupt_ends_what_runs_before_it_goes_on(tmp_path: Path, monkeypatch) -> None:
    class Interrupted:
        """As a queue is at Ctrl-C."""

        def put(self, _) -> None: ...

        def get(self):
            raise KeyboardInterrupt

    def place(root, name: str, *, cancelled, **_) -> bool:
        while not cancelled():
            pass
        raise child.Cancelled

    monkeypatch.setattr("app.flow.tasks.SimpleQueue", Interrupted)
    with pytest.raises(KeyboardInterrupt):
        performed(tmp_path, place)
    assert ended(tmp_path) == {"one": "cancelled", "run": "cancelled"}
