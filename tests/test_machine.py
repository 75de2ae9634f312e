"""Where simulations run, as the environment says it."""

from __future__ import annotations

import pytest

from pipeline import machine
from pipeline.errors import UserError


def test_the_environment_says_device_and_workers(monkeypatch) -> None:
    for name in ("SLING_DEVICE", "SLING_WORKERS"):
        monkeypatch.delenv(name, raising=False)
    assert (machine.device(), machine.workers()) == ("cpu", None)
    monkeypatch.setenv("SLING_DEVICE", "cuda:0")
    monkeypatch.setenv("SLING_WORKERS", "3")
    assert (machine.device(), machine.workers()) == ("cuda:0", 3)


@pytest.mark.parametrize(
    ("name", "value"),
    [("DEVICE", "tpu"), *(("WORKERS", text) for text in ("0", "-1", "two", "1.5", "²", "٢"))],
)
def test_anything_else_is_refused(monkeypatch, name: str, value: str) -> None:
    monkeypatch.setenv(f"SLING_{name}", value)
    with pytest.raises(UserError, match=f"SLING_{name} must be"):
        getattr(machine, name.lower())()
