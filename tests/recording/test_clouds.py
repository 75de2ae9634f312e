"""Clouds out of masked pictures, and how well they cover the band."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import open3d
import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording import clouds as cloud
from sling2sim2real.recording.clouds import by_phase, over_time, share_covered, share_off_plane
from sling2sim2real.recording.images import depth
from sling2sim2real.recording.messages import Picture
from sling2sim2real.settings.recording import CloudParams
from tests.recording.conftest import of_pictures
from validation.recordings import looks
from validation.recordings.looks import BAND, LOOKS

SETTINGS = CloudParams()


def tube(count: int, random: np.random.Generator) -> np.ndarray:
    """Points on half a band of 10 mm, (count, 3)."""
    angle = random.uniform(0, np.pi, count)
    across = 0.005 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.column_stack([random.uniform(0, 0.4, count), across])


def test_strays_are_removed_and_the_band_is_covered() -> None:
    random = np.random.default_rng(0)
    strays = random.uniform([0, 0.05, 0.05], [0.4, 0.3, 0.3], (40, 3))
    points = cloud.sample(np.concatenate([tube(4000, random), strays]), SETTINGS)
    assert points.shape == (SETTINGS.points, 3) and points.dtype == np.float32
    assert np.hypot(points[:, 1], points[:, 2]).max() < 0.0051
    gaps = np.diff(np.sort(points[:, 0]))  # the farthest points first: no gap is left
    assert gaps.max() < 0.01
    assert np.ptp(points[:, 0]) > 0.39


def test_the_papers_order_samples_first_and_so_keeps_more_strays() -> None:
    """Both orders against Open3D's filters and NumPy; strays are farthest, so all are sampled."""
    random = np.random.default_rng(0)
    strays = random.uniform([0, 0.05, 0.05], [0.4, 0.3, 0.3], (40, 3))
    points = np.concatenate([tube(4000, random), strays])
    settings = SETTINGS.model_copy(update={"points": 300, "radius_neighbors": 2})
    literal = settings.model_copy(update={"sampling": "before_filters"})

    def filtered(cloud: np.ndarray) -> np.ndarray:
        dense = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(cloud))
        dense, _ = dense.remove_statistical_outlier(
            settings.statistical_neighbors, settings.statistical_ratio
        )
        dense, _ = dense.remove_radius_outlier(settings.radius_neighbors, settings.radius)
        return np.asarray(dense.points)

    def sampled(cloud: np.ndarray) -> np.ndarray:
        chosen, away = [0], np.full(len(cloud), np.inf)
        while len(chosen) < settings.points:
            away = np.minimum(away, ((cloud - cloud[chosen[-1]]) ** 2).sum(axis=1))
            chosen.append(int(away.argmax()))
        return cloud[chosen]

    def rows(cloud: np.ndarray) -> set:
        return {tuple(row) for row in np.asarray(cloud, np.float32).tolist()}

    ours, papers = (
        rows(cloud.sample(points, cloud_params)) for cloud_params in (settings, literal)
    )
    assert ours == rows(sampled(filtered(points)))
    assert papers == rows(filtered(sampled(points)))
    assert len(ours) == settings.points > len(papers) > 0.5 * settings.points


def test_few_points_are_no_cloud() -> None:
    assert cloud.sample(np.zeros((0, 3)), SETTINGS).shape == (0, 3)
    few = tube(SETTINGS.statistical_neighbors, np.random.default_rng(0))
    assert cloud.sample(few, SETTINGS).shape == (0, 3)


def test_of_a_thin_band_no_more_neighbours_are_asked_for_than_it_has() -> None:
    """One pixel every 3 mm: within 1 cm there are six others, less those without depth."""
    line = np.column_stack([np.arange(0, 0.4, 0.003), *np.zeros((2, 134))])
    line = line[np.random.default_rng(0).random(134) > 0.4]
    strict = cloud.sample(line, SETTINGS)
    retained = cloud.sample(line, SETTINGS, density=1 / 0.003)
    assert len(retained) > 0.9 * len(line) > 2 * len(strict)


def test_a_recording_in_which_no_band_is_seen_is_refused(monkeypatch) -> None:
    view, _ = looks.view_of(LOOKS["orange on grey, white arm"], looks.times(4))
    nothing = SimpleNamespace(mask=lambda frame: np.zeros_like(frame.near))
    monkeypatch.setattr(cloud, "masker", lambda *given: nothing)
    with pytest.raises(UserError, match="not found in 4 of 4 frames"):
        cloud.clouds_of(view, SETTINGS)


@pytest.mark.parametrize(
    ("factor", "kind", "swapped", "words"),
    [
        (10, np.uint16, False, "about 9.9 times"),
        (3, np.uint16, False, "about 3 times"),
        (0.1, np.uint16, False, "about 0.098 times"),
        (1, np.float32, False, "about 990 times"),
        (1, np.uint16, True, "of the byte order"),
        (0.001, np.float32, True, "of the byte order"),
        (1, np.uint16, False, ""),
        (0.001, np.float32, False, ""),
    ],
)
def test_depth_of_another_unit_or_order_is_named(factor, kind, swapped, words) -> None:
    """As a driver would send it, of depth in millimetres."""
    view, _ = looks.view_of(LOOKS["orange on grey, white arm"], looks.times(6))
    encoding, values = {np.uint16: "16UC1", np.float32: "32FC1"}[kind], []
    for picture in view.recording.depth.values:
        sent = (np.round(1000 * depth(picture)) * factor).astype(np.dtype(kind).newbyteorder("<"))
        size = *sent.shape, sent.strides[0]
        values.append(Picture(encoding, "", sent.view(np.uint8).ravel(), *size, swapped))
    depths = replace(view.recording.depth, values=values)
    view.recording = replace(view.recording, depth=depths)
    with pytest.raises(UserError, match=words) if words else nullcontext():
        assert cloud.clouds_of(view, SETTINGS).empty == 0


def test_colours_of_a_camera_apart_belong_to_their_points() -> None:
    """What the colour camera does not see is black; it never takes the colour of what hides it."""
    look = LOOKS["orange, colour camera apart"]
    view, truths = looks.view_of(look, looks.times(6))
    orange, hidden, there = [], 0, 0
    for number, frame in view.frames():
        part = truths[number].part[view.window]
        right = np.abs(frame.depth - truths[number].depth[view.window]) < 0.003
        ratio = frame.color[..., 2].astype(float) - frame.color[..., 0]
        black = ~frame.color.any(axis=-1)
        band = right & (part == BAND)
        orange.append(np.mean(ratio[band & ~black] > 40))
        behind = right & np.isin(part, (looks.FLOOR_ID, looks.TILE, looks.WALL))
        there += behind.sum()
        hidden += (behind & black).sum()
        assert np.mean(ratio[behind] > 40) < 0.002  # orange on the floor
        assert (frame.pixels[black & (frame.depth > 0)] == -1).mean() > 0.9
    assert np.mean(orange) > 0.9
    assert 0 < hidden < 0.2 * there


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
