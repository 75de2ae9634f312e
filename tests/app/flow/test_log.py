"""What a run writes of itself."""

import fcntl
import json
import threading
from pathlib import Path

import pytest

from app.flow import log
from pipeline.base.errors import UserError

LOCK = (
    "schema: '2.0'\nstages:\n  a@b-m:\n    cmd: x\n    outs:\n    - path: y\n  a@b-n:\n    cmd: z\n"
)


def written(root: Path) -> list[dict]:
    (path,) = (root / log.FOLDER).iterdir()
    return [json.loads(line) for line in path.read_text("utf-8").splitlines()]


def without_time(root: Path) -> list[dict]:
    return [
        {name: value for name, value in event.items() if name != "at"} for event in written(root)
    ]


def test_a_run_in_lines(tmp_path: Path) -> None:
    (tmp_path / "dvc.lock").write_text(LOCK)
    with log.RunLog(tmp_path, "sling flow", ["a@b-m", "a@b-n"]) as run:
        run.begins("a@b-m", ("c",))
        run.line("a@b-m", "Größe \udcff")
        run.ended("a@b-m", "ran")
        run.message = "all is well"
    begins, *others = without_time(tmp_path)
    assert begins.pop("id")
    assert begins == {
        "what": "begins", "command": "sling flow", "name": "b: m, n", "tags": ["b", "m", "n"],
    }  # fmt: skip
    assert others == [
        {"what": "stage", "stage": "a@b-m", "producers": ["c"]},
        {"what": "line", "stage": "a@b-m", "text": "Größe ?"},
        {"what": "ended", "stage": "a@b-m", "state": "ran", "message": ""},
        {
            "what": "ended",
            "state": "ran",
            "message": "all is well",
            "made": {"a@b-m": log.entry(tmp_path, "a@b-m")},
        },
    ]
    times = [event["at"] for event in written(tmp_path)]
    assert times == sorted(times)


def test_how_a_run_ended_is_noted_and_what_it_raised_goes_on(tmp_path: Path) -> None:
    for number, (error, state, message) in enumerate((
        (UserError("a: no"), "failed", "2 ran; a: no"),
        (ZeroDivisionError("x"), "failed", "2 ran; ZeroDivisionError"),
        (KeyboardInterrupt(), "cancelled", "2 ran; KeyboardInterrupt"),
    )):  # fmt: skip
        root = tmp_path / str(number)
        with pytest.raises(type(error)), log.RunLog(root, "sling fit", ["a@b"]) as run:
            run.begins("a@b")
            run.message = "2 ran"
            raise error
        end = without_time(root)[-1]
        assert end == {"what": "ended", "state": state, "message": message, "made": {}}


def test_a_run_without_stages_leaves_none_and_only_so_many_stay(tmp_path: Path) -> None:
    with log.RunLog(tmp_path, "sling flow", []):
        pass
    assert not (tmp_path / log.FOLDER).exists()
    (tmp_path / log.FOLDER).mkdir(parents=True)
    for number in range(log.KEPT + 3):
        (tmp_path / log.FOLDER / f"20200101T0000{number:02}Z-x.jsonl").touch()
    with log.RunLog(tmp_path, "sling flow", []) as run:
        run.begins("a")
    left = sorted(file.name for file in (tmp_path / log.FOLDER).iterdir())
    assert len(left) == log.KEPT and left[0] == "20200101T000004Z-x.jsonl"


def test_a_log_is_locked_while_its_run_lasts(tmp_path: Path) -> None:
    def locked() -> bool:
        (path,) = (tmp_path / log.FOLDER).iterdir()
        with path.open("rb") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                return True
        return False

    with log.RunLog(tmp_path, "sling flow", []) as run:
        run.begins("a")
        assert locked()
    assert not locked()


def test_a_log_that_cannot_be_written_stops_no_run(tmp_path: Path) -> None:
    (tmp_path / "logs").touch()  # where its folder should be
    with log.RunLog(tmp_path, "sling flow", []) as run:
        run.begins("a")
        run.ended("a", "ran")
    assert (tmp_path / "logs").read_bytes() == b""


def test_lines_of_threads_stay_whole(tmp_path: Path) -> None:
    with log.RunLog(tmp_path, "sling flow", []) as run:
        threads = [
            threading.Thread(target=lambda: [run.line("a", "x" * 5000) for _ in range(50)])
            for _ in range(8)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    texts = [event["text"] for event in written(tmp_path) if event["what"] == "line"]
    assert texts == ["x" * 5000] * 400


def test_an_entry_of_dvc_lock_is_one_stages_own(tmp_path: Path) -> None:
    assert log.entry(tmp_path, "a@b-m") == ""
    path = tmp_path / "dvc.lock"
    path.write_text(LOCK)
    first, other = log.entry(tmp_path, "a@b-m"), log.entry(tmp_path, "a@b-n")
    assert first and other and first != other and log.entry(tmp_path, "a@b") == ""
    path.write_text(LOCK.replace("cmd: z", "cmd: new"))
    assert log.entry(tmp_path, "a@b-m") == first and log.entry(tmp_path, "a@b-n") != other


def test_names_and_tags_are_bands_and_methods() -> None:
    methods = ["no_work", "de", "bo", "adam", "package_si"]
    stages = ["record@b1", "report", *(f"theta@b2-{method}" for method in methods)]
    assert log.tags(stages[2]) == ["b2", "no_work"] and log.tags(stages[1]) == []
    name, tags = log.names(stages)
    assert name == "b1, b2: no_work, de, bo, 2 more"
    assert tags == ["b1", "b2", *methods]
    assert log.names(stages[1:2]) == ("report", [])
