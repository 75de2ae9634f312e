"""Clouds out of masked pictures, and which colour belongs to which depth pixel."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import open3d
import pytest

from pipeline.params import load
from sling2sim2real.base.errors import UserError
from sling2sim2real.recording import clouds as cloud
from tests.project import DEFAULTS
from validation.recordings import looks
from validation.recordings.looks import BAND, LOOKS

SETTINGS = load(DEFAULTS).cloud.model_copy(update={"sampling": "after_filters"})


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
