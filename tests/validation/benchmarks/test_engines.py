"""`sling bench --peers`: what is missing is said; what is there is timed and compared."""

import sys

import pytest

from pipeline.base.errors import UserError
from pipeline.params import load
from tests.project import DEFAULTS
from validation.benchmarks import engines as bench


def test_a_missing_peer_is_an_entry_that_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    monkeypatch.setitem(sys.modules, "newton", None)
    monkeypatch.setattr(bench, "ENVIRONMENTS", {"cpu": (2, 1)})
    ours, *peers = bench.bench_peers(load(DEFAULTS))
    assert ours["cpu_s_per_rollout"] > 0
    assert ours["ratio"] == 1.0
    assert abs(ours["force_error"]) < 0.02
    assert len(bench.table([ours, *peers]).splitlines()) == 3
    assert [(peer["name"], peer["note"]) for peer in peers] == [
        ("mujoco", "mujoco is not installed: make setup"),
        ("newton", "newton is not installed: pip install -e '.[export]' -c constraints.txt"),
    ]


def test_a_device_that_is_not_there_is_refused():
    with pytest.raises(UserError, match="device tpu"):
        bench.bench_peers(load(DEFAULTS), "tpu")


@pytest.mark.validation
def test_both_peers_are_slower():
    pytest.importorskip("mujoco", reason="mujoco: pip install -e '.[validation]'")
    pytest.importorskip("newton", reason="newton: pip install -e '.[validation]'")
    _, mujoco, newton = bench.bench_peers(load(DEFAULTS))
    assert mujoco["ratio"] > 50
    assert newton["ratio"] > 100
    assert abs(mujoco["force_error"]) < 0.02
