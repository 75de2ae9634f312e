"""Damaged recordings, each an episode or one clear line; nothing passes silently."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from pipeline.base.errors import UserError
from pipeline.recording.build import episode_of, process
from validation.campaigns import mutations, outcomes
from validation.campaigns.damage import mutated
from validation.recordings.small import (
    FAMILIES,
    small_params,
    write_small,
)

EACH = 10
SORTS = (outcomes.SAME, outcomes.SAID, outcomes.LINE)
CELLS = [*zip(FAMILIES, ("zstd", "lz4", "plain", "unchunked"), strict=True), ("json", "garbage")]


@pytest.mark.slow
def test_the_first_mutations_of_each_family(tmp_path) -> None:
    """Of those of the campaign."""
    results = []
    mutations.run(tmp_path, [(*cell, 0, EACH) for cell in CELLS], 1, results.append)
    assert len({mutations.key(result) for result in results}) == len(results) == EACH * len(CELLS)
    assert mutations.faults(results) == []
    assert {*SORTS} <= {
        result["outcome"] for result in results
    }  # the damage was not all of one sort
    on_result = mutations.summary(results, len(results))
    assert on_result["met"] and on_result["figures"]["recordings"] == len(results)
    assert not mutations.summary(results, len(results) + 1)["met"]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Params, a recording, what is made of it, and its episode."""
    params, path = small_params(), tmp_path_factory.mktemp("small") / "small.mcap"
    write_small(path, "ros2", "plain")
    done = process(path, params.bands["band1"], params)
    return params, path, done, episode_of(done, "band1", params)


def outcome(whole, monkeypatch, result, checked: bool = True) -> tuple[str, str]:
    params, path, done, episode = whole

    def processed(*_):
        if isinstance(result, Exception):
            raise result
        return done

    monkeypatch.setattr(outcomes, "process", processed)
    monkeypatch.setattr(outcomes, "episode_of", lambda *_: result)
    return outcomes.outcome(path, params, episode, outcomes.message(done), checked)


def test_what_counts_as_a_fault(whole, monkeypatch) -> None:
    _, path, _, episode = whole
    other = replace(episode, force=episode.force + 1e-12)
    for result, checked, came in (
        (episode, True, outcomes.SAME),
        (other, True, outcomes.FAULT),
        (other, False, outcomes.OTHER),
        (UserError(f"{path}: is empty"), True, outcomes.LINE),
        (UserError("says not which file"), True, outcomes.FAULT),
        (UserError(f"{path}: two\nlines"), True, outcomes.FAULT),
        (UserError(f"{path}: a bell\a"), True, outcomes.FAULT),
    ):
        assert outcome(whole, monkeypatch, result, checked)[0] == came
    came, words = outcome(whole, monkeypatch, KeyError("stamp"))
    assert came == outcomes.FAULT and words.startswith("KeyError: 'stamp' (test_mutations.py:")


@pytest.mark.parametrize("name", ["ros2-plain", "json-garbage"])
def test_equal_seeds_do_equal_damage(name, tmp_path) -> None:
    path = tmp_path / "small.mcap"
    write_small(path, *name.split("-"))
    content = path.read_bytes()
    damaged = [mutated(content, name, seed) for seed in (*range(20), 0)]
    assert damaged[0] == damaged[-1]
    assert len({content, *damaged}) > 18


def test_only_what_is_not_done_is_shared_out() -> None:
    parts = mutations.shares(1000, set())
    seeds = [(*part[:2], seed) for part in parts for seed in range(*part[2:])]
    assert len(seeds) == len(set(seeds)) == 1000
    assert mutations.shares(1000, set(seeds)) == []
    left = {("json", "lz4", 3), ("json", "lz4", 4), ("json", "lz4", 9)}
    assert mutations.shares(1000, set(seeds) - left) == [
        ("json", "lz4", 3, 5),
        ("json", "lz4", 9, 10),
    ]


@pytest.mark.parametrize("end", ["hang", "exit", "between"])
def test_a_process_that_ends_too_early_names_its_recording(tmp_path, monkeypatch, end) -> None:
    """By another program in the place of the one that reads recordings."""
    case = {"family": "ros2", "container": "lz4"}
    (tmp_path / "sitecustomize.py").write_text(
        f"""\
import faulthandler, json, os, signal, sys
if "validation.campaigns.outcomes" in sys.orig_argv:
    first, end = map(int, sys.orig_argv[-2:])
    for seed in range(first, end):
        if seed == 4 and {end!r} == "between":
            os._exit(3)
        print(json.dumps(dict({case!r}, seed=seed)), flush=True)
        if seed == 4 and {end!r} == "hang":
            faulthandler.register(signal.SIGPROF, chain=True)
            signal.setitimer(signal.ITIMER_PROF, 0.2)
            while True:
                pass
        if seed == 4:
            os._exit(3)
        print(json.dumps(dict({case!r}, seed=seed, outcome="same episode", s=0, bytes=0)),
              flush=True)
    os._exit(0)
"""
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    results = list(mutations._results(tmp_path, *case.values(), 2, 7))
    assert [result["seed"] for result in results] == [2, 3, 4, 5, 6]
    (fault,) = mutations.faults(results)
    assert fault["seed"] == 4 and json.dumps(fault)
    assert ("sitecustomize.py" in fault["words"]) == (end == "hang")
    assert ("before it began" in fault["words"]) == (end == "between")


def test_nothing_begins_when_the_time_is_over(tmp_path) -> None:
    results = []
    mutations.run(tmp_path, [("ros2", "zstd", 0, 3)], 1, results.append, end=0.0)
    assert results == [] and (tmp_path / "ros2-zstd.mcap").exists()
