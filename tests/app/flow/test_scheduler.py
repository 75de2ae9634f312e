"""Order, limits and failures, without anything that runs."""

from app.flow.graph import Stage
from app.flow.scheduler import Scheduler, width
from pipeline.base.errors import UserError


def stages(**producers: str) -> list[Stage]:
    """Stages by name; those that begin with g compute on the GPU."""
    return [
        Stage(name, name, "", tuple(some.split()), name.startswith("g"))
        for name, some in producers.items()
    ]


class Run(Scheduler):
    """A scheduler by names."""

    def begun(self) -> list[str]:
        """All that can begin now, as it begins."""
        self.by_name = {
            **getattr(self, "by_name", {}),
            **{stage.name: stage for stage in self.waiting},
        }
        return [stage.name for stage, _ in iter(self.next, None)]

    def ends(self, name: str, outcome: bool | UserError = True) -> list[str]:
        """What begins when that one has ended."""
        self.done(self.by_name[name], outcome)
        return self.begun()


def test_consumers_wait_for_all_their_producers() -> None:
    run = Run(stages(a="", b="a", c="a", d="b c"), workers=4)
    assert run.begun() == ["a"]
    assert run.ends("a") == ["b", "c"]
    assert run.ends("c", False) == []
    assert run.ends("b") == ["d"]
    run.ends("d")
    assert (run.ran, run.fresh, run.failed) == (["a", "b", "d"], ["c"], {})
    assert run.summary() == "stages: 3 ran, 1 fresh after all, 0 failed, 0 not run"
    alone = Run(stages(b="a", c="b"), workers=4)  # a is fresh from the start: not waited for
    assert alone.begun() == ["b"]


def test_no_more_at_a_time_than_workers_and_shares_of_the_gpu() -> None:
    run = Run(stages(a="", b="", c=""), workers=2)
    assert run.begun() == ["a", "b"]
    assert run.ends("b") == ["c"]
    share = {"SLING_DEVICE": "cuda:1"}
    run = Run(stages(g1="", g2="", c=""), workers=3, shares=[share])
    assert run.begun() == ["g1", "c"]  # who needs no share may pass
    assert run.running == {"g1": share, "c": {}}
    assert run.ends("g1") == ["g2"]
    assert run.running["g2"] == share


def test_what_follows_from_a_failure_is_not_run_and_the_rest_is() -> None:
    run, error = Run(stages(a="", x="", b="a", y="x", c="b y"), workers=2), UserError("a: broken")
    assert run.begun() == ["a", "x"]
    assert run.ends("a", error) == []
    assert run.ends("x") == ["y"]
    assert run.ends("y") == []
    assert (run.failed, run.not_run, run.running) == ({"a": error}, ["b", "c"], {})


def test_width_is_how_many_can_run_at_once() -> None:
    assert width(stages(a="", b="a", c="a", d="b c")) == 2
    assert width(stages(a="", b="a", c="b")) == 1
    assert width(stages(b="a", c="a", d="a")) == 3  # of a fresh a
