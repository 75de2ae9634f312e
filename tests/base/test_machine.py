"""Where simulations run, as the environment says it."""

import os
from pathlib import Path

import pytest

from sling2sim2real.base import machine
from sling2sim2real.base.errors import UserError


@pytest.fixture
def three(monkeypatch):
    """A machine on which CUDA sees three GPUs."""
    monkeypatch.setattr(machine, "gpus", lambda: ("cuda:0", "cuda:1", "cuda:2"))


def test_the_environment_says_device_and_workers(monkeypatch, three) -> None:
    for name in ("SLING_DEVICE", "SLING_WORKERS"):
        monkeypatch.delenv(name, raising=False)
    assert (machine.device(), machine.kind(), machine.workers()) == ("cpu", "cpu", None)
    monkeypatch.setenv("SLING_DEVICE", "cuda:1")
    monkeypatch.setenv("SLING_WORKERS", "3")
    assert (machine.device(), machine.kind(), machine.workers()) == ("cuda:1", "cuda", 3)


def test_a_gpu_is_named_or_refused(three) -> None:
    assert [machine.named(text, "") for text in ("cuda", "cuda:2")] == ["cuda:0", "cuda:2"]
    with pytest.raises(UserError, match="^--device cuda:3: .*CUDA sees cuda:0, cuda:1, cuda:2$"):
        machine.named("cuda:3", "--device")


def test_anything_else_is_refused(monkeypatch) -> None:
    devices = "tpu cpu,cuda:0 cuda:0,cuda:1 cuda: cuda:-1 cuda:01 cuda:0,"
    wrong = {"DEVICE": (machine.device, devices), "WORKERS": (machine.workers, "0 -1 two 1.5 ² ٢")}
    for name, (read, texts) in wrong.items():
        for text in texts.split():
            monkeypatch.setenv(f"SLING_{name}", text)
            with pytest.raises(UserError, match=f"SLING_{name} must be"):
                read()


def test_cores_are_those_that_this_process_may_use(monkeypatch, tmp_path: Path) -> None:
    """As its container's limit has it; SLING_WORKERS comes first."""
    monkeypatch.delenv("SLING_WORKERS", raising=False)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(8)), raising=False)
    monkeypatch.setattr(machine, "LIMIT", tmp_path / "cpu.max")
    assert machine.cores() == 8
    limits = {"max": 8, "250000": 3, "50000": 1, "9900000": 8}
    for limit, expected in limits.items():
        machine.LIMIT.write_text(f"{limit} 100000\n")
        assert machine.cores() == expected
    monkeypatch.setenv("SLING_WORKERS", "20")
    assert machine.cores() == 20
