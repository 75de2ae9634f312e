"""Tests hold the same checks as the report, at smaller sizes."""

from __future__ import annotations

from collections.abc import Iterable

from validation.simulator.finding import Finding, unmet


def assert_kept(checks: Iterable[Finding]) -> None:
    """Every check keeps its limit; at least one has one."""
    checks = list(checks)
    assert any(check.limit is not None for check in checks)
    missed = unmet(checks)
    assert not missed, "\n".join(
        f"{check.name}: {check.value:.4g} {check.unit}, limit {check.limit:g} ({check.note})"
        for check in missed
    )
