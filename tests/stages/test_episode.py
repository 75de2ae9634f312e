"""The stage that turns a band's folder of recordings into a folder of episodes."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from pipeline.layout import Layout
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import NotMade
from sling2sim2real.episode.episode import Episode
from stages import episode
from tests.recording.conftest import blind, params, seen
from tests.recording.parts import joined, split

__all__ = ["blind", "params", "seen"]


@pytest.fixture
def folder(tmp_path: Path, params, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Of band1's recordings, in an empty project."""
    monkeypatch.chdir(tmp_path)
    recording = params.run.recordings["band1"]
    monkeypatch.setattr(episode, "recording_of_stage", lambda: (params, recording))
    return Layout().raw(recording)


def saved() -> list[Episode]:
    return Episode.load_all(Path("data/episodes/band1/plain"))


def test_each_pull_of_each_file_becomes_an_episode_in_order(folder, seen, blind, capsys) -> None:
    folder.mkdir(parents=True)
    shutil.copy(seen[0], folder / "b.mcap")
    joined(folder / "a.mcap", [blind[0], seen[0]])
    left = Path("data/episodes/band1/plain/3")  # by an earlier run
    left.mkdir(parents=True)
    episode.main()
    inputs = [made.metadata["input"] for made in saved()]
    pulls = [(source["file"], source["pull"]) for source in inputs]
    assert pulls == [("a.mcap", 2), ("b.mcap", 1)]
    assert not left.exists()
    message = capsys.readouterr()
    assert message.err.startswith(
        "warning: left out: data/raw/band1/plain/a.mcap: pull 1 of 2: empty mask"
    )
    assert message.err.count("\n") == 1 and message.out.count("peak force") == 2


def test_a_split_bag_becomes_one_episode(folder, seen) -> None:
    """As the whole file does: kept as its folder, or put there part by part."""
    split(seen[0], folder / "b", (1.0, 2.0), "b")
    split(seen[0], folder, (1.5,), "c")
    shutil.copy(seen[0], folder / "a.mcap")
    episode.main()
    whole, *parts = saved()
    assert [part.metadata["input"]["file"] for part in parts] == ["b", "c_0.mcap"]
    for part in parts:
        np.testing.assert_array_equal(part.force, whole.force)
        assert len(part.clouds) == len(whole.clouds) and part.release_time == whole.release_time


def test_a_file_without_a_pull_that_can_be_used_leaves_the_episodes_alone(
    folder, seen, blind
) -> None:
    folder.mkdir(parents=True)
    shutil.copy(seen[0], folder / "a.mcap")
    episode.main()
    before = Path("data/episodes/band1/plain/1").stat().st_ino
    shutil.copy(blind[0], folder / "b.mcap")
    with pytest.raises(UserError, match="b.mcap: empty mask"):
        episode.main()
    assert Path("data/episodes/band1/plain/1").stat().st_ino == before


def test_a_recording_without_files_is_missing(folder) -> None:
    with pytest.raises(NotMade, match="data/raw/band1/plain/band1.mcap: missing"):
        episode.main()
