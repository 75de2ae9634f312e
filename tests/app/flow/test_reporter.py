"""What is shown of a stage's lines, how often, and that trouble with showing reaches nobody."""

import logging
import threading
import time
from types import SimpleNamespace

import prefect.artifacts
import pytest

from app.flow import reporter
from app.flow.graph import Stage

STAGE = Stage("theta@band1-no_work", "theta", "band1-no_work", (), False)


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch) -> list[tuple]:
    """What Prefect is asked to show, in order."""
    calls: list[tuple] = []

    def stand_in(name: str) -> None:
        def call(*arguments) -> str:
            calls.append((name, *arguments))
            return f"id {len(calls)}"

        monkeypatch.setattr(prefect.artifacts, name, call)

    for name in ("create_progress", "update_progress", "create_markdown"):
        stand_in(f"{name}_artifact")
    monkeypatch.setattr(reporter, "_logger", lambda: logging.getLogger("task"))
    monkeypatch.setattr(reporter, "artifact", lambda stage, root: "")
    return calls


def test_a_bar_moves_at_most_once_a_second_and_to_its_end(shown, monkeypatch, tmp_path) -> None:
    clock = iter([0.0, 0.5, 1.25, 1.5])
    monkeypatch.setattr(reporter, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    seen = reporter.Reporter(STAGE, tmp_path)
    for done in (1, 2, 3, 4):
        seen(f"policy-band1-no_work {done}/4 iterations  mean error {done}.00 cm")
    seen.done()
    bars = {1: "██░░░░░░░░", 3: "███████░░░", 4: "██████████"}
    words = [f"{bar} · {done}/4 iterations · mean error {done}.00 cm" for done, bar in bars.items()]
    assert shown == [
        ("create_progress_artifact", 25.0, "policy-band1-no-work", words[0]),
        ("update_progress_artifact", "id 1", 75.0, words[1]),
        ("update_progress_artifact", "id 1", 100.0, words[2]),
    ]


def test_a_stages_lines_are_logged_and_two_bars_are_told_apart(shown, tmp_path, caplog) -> None:
    seen = reporter.Reporter(STAGE, tmp_path)
    lines = ["x 1/2 rollouts", "x-second 1/2 steps", "words", "error: params.yaml: no such file"]
    with caplog.at_level(logging.INFO):
        for line in lines:
            seen(line)
    seen.done()
    said = [(one.levelname, one.message) for one in caplog.records if one.name == "task"]
    assert said == [*(("INFO", line) for line in lines[:3]), ("ERROR", lines[3])]
    assert [call[:3] for call in shown] == [
        ("create_progress_artifact", 50.0, "x"),
        ("create_progress_artifact", 50.0, "x-second"),
    ]


def test_what_a_stage_wrote_carries_its_name_and_need_not_be_drawn(
    shown, monkeypatch, tmp_path
) -> None:
    monkeypatch.setattr(reporter, "artifact", lambda stage, root: "| a |")
    reporter.Reporter(STAGE, tmp_path).done()
    monkeypatch.setattr(reporter, "artifact", lambda stage, root: 1 / 0)
    reporter.Reporter(STAGE, tmp_path).done()
    assert shown == [("create_markdown_artifact", "| a |", "theta-band1-no-work", STAGE.name)]


def test_prefects_failure_is_told_once_and_ends_the_artifacts(
    shown, monkeypatch, tmp_path, caplog
) -> None:
    def gone(*arguments):
        raise ConnectionError("no server")

    monkeypatch.setattr(prefect.artifacts, "create_progress_artifact", gone)
    seen = reporter.Reporter(STAGE, tmp_path)
    for title in ("x", "y"):
        seen(f"{title} 1/2 rollouts")
        time.sleep(0.2)
    seen.done()
    warnings = [one.message for one in caplog.records if one.levelname == "WARNING"]
    assert warnings == ["no more artifacts of theta@band1-no_work: no server"]
    assert shown == []


def test_a_slow_server_keeps_neither_lines_nor_the_end(shown, monkeypatch, tmp_path) -> None:
    free = threading.Event()
    monkeypatch.setattr(prefect.artifacts, "create_progress_artifact", lambda *a: free.wait(60))
    monkeypatch.setattr(reporter, "WAITING", 0.1)
    seen, begin = reporter.Reporter(STAGE, tmp_path), time.monotonic()
    for title in "abc":
        seen(f"{title} 1/2 rollouts")
    seen.done()
    assert time.monotonic() - begin < 5
    free.set()


def test_outside_of_any_task_nothing_is_shown(tmp_path) -> None:
    seen = reporter.Reporter(STAGE, tmp_path)
    seen("x 1/2 rollouts")
    assert seen._failed
    seen.done()


def test_names_and_tags_are_bands_and_methods() -> None:
    methods = ["no_work", "de", "bo", "adam", "package_si"]
    stages = [
        Stage("record@b1", "record", "b1", (), False),
        Stage("report", "report", "", (), False),
    ]
    stages += [Stage(f"theta@b2-{one}", "theta", f"b2-{one}", (), False) for one in methods]
    assert reporter.tags(stages[2]) == ["b2", "no_work"] and reporter.tags(stages[1]) == []
    name, tags = reporter.names(stages)
    assert name == "b1, b2: no_work, de, bo, 2 more"
    assert tags == ["b1", "b2", *methods]
    assert reporter.names(stages[1:2]) == ("report", [])
