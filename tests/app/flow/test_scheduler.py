"""Order, limits and failures, without anything that runs."""

from __future__ import annotations

from app.flow.graph import Stage
from app.flow.scheduler import Scheduler, width
from pipeline.base.errors import UserError


def stages(**producers: str) -> list[Stage]:
    """Stages by name; those that begin with g compute on the GPU."""
    return [
        Stage(name, name, "", tuple(some.split()), name.startswith("g"))
        for name, some in producers.items()
    ]


def begun(scheduler: Scheduler) -> list[str]:
    """All that can begin now, as it begins."""
    names = []
    while found := scheduler.next():
        names.append(found[0].name)
    return names


def done(scheduler: Scheduler, name: str, outcome: bool | UserError, all_of: list[Stage]) -> None:
    scheduler.done(next(one for one in all_of if one.name == name), outcome)


def test_consumers_wait_for_all_their_producers() -> None:
    diamond = stages(a="", b="a", c="a", d="b c")
    scheduler = Scheduler(list(diamond), workers=4)
    assert begun(scheduler) == ["a"]
    done(scheduler, "a", True, diamond)
    assert begun(scheduler) == ["b", "c"]
    done(scheduler, "c", False, diamond)
    assert begun(scheduler) == []
    done(scheduler, "b", True, diamond)
    assert begun(scheduler) == ["d"]
    done(scheduler, "d", True, diamond)
    assert (scheduler.ran, scheduler.fresh, scheduler.failed) == (["a", "b", "d"], ["c"], {})
    assert scheduler.summary() == "stages: 3 ran, 1 fresh after all, 0 failed, 0 not run"


def test_a_producer_that_is_fresh_from_the_start_is_not_waited_for() -> None:
    scheduler = Scheduler(stages(b="a", c="b"), workers=4)  # a is not on the scheduler
    assert begun(scheduler) == ["b"]


def test_no_more_at_a_time_than_workers() -> None:
    free = stages(a="", b="", c="")
    scheduler = Scheduler(list(free), workers=2)
    assert begun(scheduler) == ["a", "b"]
    done(scheduler, "b", True, free)
    assert begun(scheduler) == ["c"]


def test_a_gpu_stage_waits_for_a_share_and_lets_others_pass() -> None:
    mixed = stages(g1="", g2="", c="")
    scheduler = Scheduler(list(mixed), workers=3, shares=[{"SLING_DEVICE": "cuda:1"}])
    stage, share = scheduler.next()
    assert (stage.name, share) == ("g1", {"SLING_DEVICE": "cuda:1"})
    stage, share = scheduler.next()
    assert (stage.name, share) == ("c", {})
    assert scheduler.next() is None
    done(scheduler, "g1", True, mixed)
    stage, share = scheduler.next()
    assert (stage.name, share) == ("g2", {"SLING_DEVICE": "cuda:1"})


def test_what_follows_from_a_failure_is_not_run_and_the_rest_is() -> None:
    chains = stages(a="", x="", b="a", y="x", c="b y")
    scheduler = Scheduler(list(chains), workers=2)
    assert begun(scheduler) == ["a", "x"]
    error = UserError("a: broken")
    done(scheduler, "a", error, chains)
    assert begun(scheduler) == []
    done(scheduler, "x", True, chains)
    assert begun(scheduler) == ["y"]
    done(scheduler, "y", True, chains)
    assert begun(scheduler) == []
    assert scheduler.failed == {"a": error}
    assert scheduler.not_run == ["b", "c"]
    assert not scheduler.running


def test_width_is_how_many_can_run_at_once() -> None:
    assert width(stages(a="", b="a", c="a", d="b c")) == 2
    assert width(stages(a="", b="a", c="b")) == 1
    assert width(stages(b="a", c="a", d="a")) == 3  # of a fresh a
