"""Order, limits and failures, without anything that runs."""

from __future__ import annotations

from app.flow.graph import Stage
from app.flow.scheduler import Board, width
from pipeline.base.errors import UserError


def stages(**producers: str) -> list[Stage]:
    """Stages by name; those that begin with g compute on the GPU."""
    return [
        Stage(name, name, "", tuple(some.split()), name.startswith("g"))
        for name, some in producers.items()
    ]


def begun(board: Board) -> list[str]:
    """All that can begin now, as it begins."""
    names = []
    while found := board.next():
        names.append(found[0].name)
    return names


def done(board: Board, name: str, outcome: bool | UserError, all_of: list[Stage]) -> None:
    board.done(next(one for one in all_of if one.name == name), outcome)


def test_consumers_wait_for_all_their_producers() -> None:
    diamond = stages(a="", b="a", c="a", d="b c")
    board = Board(list(diamond), workers=4)
    assert begun(board) == ["a"]
    done(board, "a", True, diamond)
    assert begun(board) == ["b", "c"]
    done(board, "c", False, diamond)
    assert begun(board) == []
    done(board, "b", True, diamond)
    assert begun(board) == ["d"]
    done(board, "d", True, diamond)
    assert (board.ran, board.fresh, board.failed) == (["a", "b", "d"], ["c"], {})
    assert board.summary() == "stages: 3 ran, 1 fresh after all, 0 failed, 0 not run"


def test_a_producer_that_is_fresh_from_the_start_is_not_waited_for() -> None:
    board = Board(stages(b="a", c="b"), workers=4)  # a is not on the board
    assert begun(board) == ["b"]


def test_no_more_at_a_time_than_workers() -> None:
    free = stages(a="", b="", c="")
    board = Board(list(free), workers=2)
    assert begun(board) == ["a", "b"]
    done(board, "b", True, free)
    assert begun(board) == ["c"]


def test_a_gpu_stage_waits_for_a_share_and_lets_others_pass() -> None:
    mixed = stages(g1="", g2="", c="")
    board = Board(list(mixed), workers=3, shares=[{"SLING_DEVICE": "cuda:1"}])
    stage, share = board.next()
    assert (stage.name, share) == ("g1", {"SLING_DEVICE": "cuda:1"})
    stage, share = board.next()
    assert (stage.name, share) == ("c", {})
    assert board.next() is None
    done(board, "g1", True, mixed)
    stage, share = board.next()
    assert (stage.name, share) == ("g2", {"SLING_DEVICE": "cuda:1"})


def test_what_follows_from_a_failure_is_not_run_and_the_rest_is() -> None:
    chains = stages(a="", x="", b="a", y="x", c="b y")
    board = Board(list(chains), workers=2)
    assert begun(board) == ["a", "x"]
    error = UserError("a: broken")
    done(board, "a", error, chains)
    assert begun(board) == []
    done(board, "x", True, chains)
    assert begun(board) == ["y"]
    done(board, "y", True, chains)
    assert begun(board) == []
    assert board.failed == {"a": error}
    assert board.not_run == ["b", "c"]
    assert not board.running


def test_width_is_how_many_can_run_at_once() -> None:
    assert width(stages(a="", b="a", c="a", d="b c")) == 2
    assert width(stages(a="", b="a", c="b")) == 1
    assert width(stages(b="a", c="a", d="a")) == 3  # of a fresh a
