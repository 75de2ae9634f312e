"""Where simulations run, as the environment says it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from pipeline.base import machine
from pipeline.base.errors import UserError


@pytest.fixture
def three(monkeypatch):
    """A machine on which CUDA sees three GPUs."""
    monkeypatch.setattr(machine, "gpus", lambda: ("cuda:0", "cuda:1", "cuda:2"))


def test_the_environment_says_devices_and_workers(monkeypatch, three) -> None:
    for name in ("SLING_DEVICE", "SLING_WORKERS"):
        monkeypatch.delenv(name, raising=False)
    assert (machine.devices(), machine.kind(), machine.workers()) == (("cpu",), "cpu", None)
    monkeypatch.setenv("SLING_DEVICE", "cuda:1")
    monkeypatch.setenv("SLING_WORKERS", "3")
    assert (machine.devices(), machine.kind(), machine.workers()) == (("cuda:1",), "cuda", 3)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("cuda", ("cuda:0", "cuda:1", "cuda:2")),
        ("cuda:2", ("cuda:2",)),
        ("cuda:2,cuda:0", ("cuda:2", "cuda:0")),
    ],
)
def test_several_gpus_are_named(three, text: str, expected: tuple[str, ...]) -> None:
    assert machine.named(text, "--device") == expected


@pytest.mark.parametrize("text", ["cuda:3", "cuda:0,cuda:3"])
def test_a_gpu_that_is_not_there_is_refused(three, text: str) -> None:
    with pytest.raises(UserError) as error:
        machine.named(text, "--device")
    assert str(error.value) == (
        f"--device {text}: cuda:3 is not there; CUDA sees cuda:0, cuda:1, cuda:2"
    )


@pytest.mark.parametrize("text", ["cuda", "cuda:0"])
def test_any_gpu_is_refused_where_cuda_sees_none(monkeypatch, text: str) -> None:
    monkeypatch.setattr(machine, "gpus", lambda: ())
    with pytest.raises(UserError, match=f"^--device {text}: CUDA sees no GPU"):
        machine.named(text, "--device")


def test_a_gpu_named_twice_is_refused(three) -> None:
    with pytest.raises(UserError, match="cuda:0,cuda:0: names a GPU twice"):
        machine.named("cuda:0,cuda:0", "SLING_DEVICE")


DEVICES = ("tpu", "cpu,cpu", "cpu,cuda:0", "cuda,cuda:0", "cuda:", "cuda:-1", "cuda:01", "cuda:0,")
WORKERS = ("0", "-1", "two", "1.5", "²", "٢")


@pytest.mark.parametrize(
    ("name", "value"),
    [*(("DEVICE", text) for text in DEVICES), *(("WORKERS", text) for text in WORKERS)],
)
def test_anything_else_is_refused(monkeypatch, name: str, value: str) -> None:
    monkeypatch.setenv(f"SLING_{name}", value)
    with pytest.raises(UserError, match=f"SLING_{name} must be"):
        {"DEVICE": machine.devices, "WORKERS": machine.workers}[name]()


@pytest.mark.parametrize(
    ("limit", "expected"),
    [
        (None, 8),
        ("max 100000\n", 8),
        ("250000 100000\n", 3),
        ("50000 100000\n", 1),
        ("9900000 100000\n", 8),
    ],
)
def test_cores_are_those_that_this_process_may_use(
    monkeypatch, tmp_path: Path, limit: str | None, expected: int
) -> None:
    """As its container's limit has it; SLING_WORKERS comes first."""
    monkeypatch.delenv("SLING_WORKERS", raising=False)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(8)), raising=False)
    monkeypatch.setattr(machine, "LIMIT", tmp_path / "cpu.max")
    if limit:
        machine.LIMIT.write_text(limit)
    assert machine.cores() == expected
    monkeypatch.setenv("SLING_WORKERS", "20")
    assert machine.cores() == 20
