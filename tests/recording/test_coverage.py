"""How well clouds cover the band, and whether they hold what is no band."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sling2sim2real.recording.clouds import by_phase, over_time, share_covered, share_off_plane
from tests.recording.made import of_pictures


def test_points_of_the_arm_in_the_hanging_band_are_said(checked, params) -> None:
    """Points 5 cm towards the hand, off the upright plane through the tips, in one picture."""
    assert "off_plane" not in {finding.about for finding in of_pictures(checked)}
    clouds = checked.clouds
    arm = np.array([[0.0, -0.05, -0.2]], np.float32).repeat(len(clouds.points[1]) // 20, 0)
    points = [*clouds.points]
    points[1] = np.vstack([points[1], arm])
    rows = over_time(checked.scene, replace(clouds, points=points), 0.0)
    assert rows[1].phase == "hanging" and rows[1].off_plane == pytest.approx(0.05, abs=0.01)
    assert all(row.off_plane in (None, 0.0) for row in (rows[0], *rows[2:]))
    (message,) = [
        finding.what
        for finding in of_pictures(replace(checked, coverage=rows))
        if finding.about == "off_plane"
    ]
    summary = sum(row.off_plane is not None for row in rows)
    assert message.startswith(
        f"1 of {summary} pictures of the hanging band hold points off the plane"
    )


def test_the_plane_is_that_of_the_tips_and_the_hand(checked) -> None:
    """Held 45 degrees below and behind the tips, points there lie in the plane, others do not."""
    hand = np.array([0.0, -0.1, -0.1])
    signals = SimpleNamespace(grasp_time=1.0, release_time=2.0, hand=lambda time: hand)
    scene = SimpleNamespace(signals=signals, holds=lambda time: 1 <= time < 2)
    points = np.array([[0.1, -0.05, -0.05], [0.0, 0.0, -0.1]])
    assert share_off_plane(scene, 1.5, points) == 0.5
    assert share_off_plane(scene, 0.5, points) == 0.5 and points[0, 1] < -0.02
    assert share_off_plane(scene, 2.5, points) is None
    assert share_off_plane(scene, 1.5, points[:0]) is None


def test_coverage_over_time_follows_the_phases(checked, seen) -> None:
    rows, truth = checked.coverage, seen[1]
    assert len(rows) == len(checked.clouds.points)
    for row in rows:
        if truth.drawn < row.time < truth.release:
            assert row.phase == "drawn" and row.coverage > 0.9
        assert (row.phase == "hanging") == (row.time < checked.start + checked.signals.grasp_time)
        assert (row.phase in ("recoil", "swing")) == (row.time >= truth.release)
    phases = by_phase(checked.coverage)
    assert [row["phase"] for row in phases] == ["hanging", "held", "drawn", "recoil", "swing"]
    assert sum(row["pictures"] for row in phases) == len(rows)


def test_a_cloud_without_one_side_covers_half(checked) -> None:
    scene, clouds = checked.scene, checked.clouds
    time = max(t for t in clouds.time if scene.taut(t))
    points = clouds.points[int(np.flatnonzero(clouds.time == time)[0])]
    assert share_covered(scene, time, points[points[:, 0] < 0]) == pytest.approx(0.5, abs=0.06)
    assert share_covered(scene, 0.0, points[:0]) == 0
    s = np.linspace(0, np.pi, 300)
    hanging = np.stack([0.1375 * np.cos(s), 0 * s, -0.2 * np.sin(s)], axis=1)
    assert share_covered(scene, 0.0, hanging) == 1
    assert share_covered(scene, 0.0, hanging[hanging[:, 0] < 0]) == pytest.approx(0.5, abs=0.1)
