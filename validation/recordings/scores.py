"""How a cloud compares with what is true of the picture it was made from (`looks`)."""

from __future__ import annotations

import numpy as np

from sling2sim2real.recording.scene import View
from validation.recordings import strand
from validation.recordings.looks import BAND, FrameTruth
from validation.recordings.strand import GRASP, RELEASE, REST, TIPS

PHASES = ("hanging", "lift", "taut", "recoil", "swing")


def phase(time: float) -> str:
    if time < GRASP:
        return "hanging"
    if time < RELEASE:
        far = np.linalg.norm(TIPS - strand.path()(time), axis=1).sum()
        return "taut" if far > 1.05 * REST else "lift"
    return "recoil" if time < RELEASE + 0.1 else "swing"


def score(
    view: View, frame: object, truth: FrameTruth, points: np.ndarray
) -> dict[str, np.ndarray]:
    """How a cloud compares with the truth.

    Returns:
        off: Distances of the points from the band's surface [m]; covered: for each 5 mm of the
        band that has pixels with depth, whether points lie within 5 mm of its surface.
    """
    nodes = np.arange(len(truth.line))
    arc = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(truth.line, axis=0), axis=1))])
    fine = np.interp(np.arange(0, arc[-1], 0.0025), arc, nodes)
    line = np.stack([np.interp(fine, nodes, axis) for axis in truth.line.T], axis=1)
    radius = np.interp(fine, nodes, truth.radius)
    part, depth = truth.part[view.window], truth.depth[view.window]
    bears = (part == BAND) & (np.abs(frame.depth - depth) < 0.005)
    away = np.linalg.norm(frame.points[bears][:, None] - line[None], axis=-1)
    seen = np.unique(away.argmin(axis=1) // 2) if len(away) else np.zeros(0, int)
    gaps = np.linalg.norm(points[:, None].astype(float) - line[None], axis=-1) - radius
    if not len(points):
        return {"off": np.zeros(0), "covered": np.zeros(len(seen), bool)}
    reached = gaps.min(axis=0) < 0.005
    bins = np.add.reduceat(reached, np.arange(0, len(line), 2)) > 0
    return {"off": np.abs(gaps.min(axis=1)), "covered": bins[seen]}


def figures(view: View, truths: list[FrameTruth], clouds: object) -> dict[str, dict[str, float]]:
    """Score all frames and each phase: median distance from the surface, covered share, strays."""
    phase_scores: dict[str, list] = {"all": []}
    numbered = zip(view.frames(), clouds.points, strict=True)
    for (number, frame), points in numbered:
        frame_score = score(view, frame, truths[number], points)
        phase_scores["all"].append(frame_score)
        phase_scores.setdefault(phase(frame.time), []).append(frame_score)
    summary = {}
    for name, scores in phase_scores.items():
        off = np.concatenate([frame_score["off"] for frame_score in scores])
        summary[name] = {
            "frames": len(scores),
            "median_off_m": float(np.median(off)),
            "covered": float(
                np.mean(np.concatenate([frame_score["covered"] for frame_score in scores]))
            ),
            "further_than_1cm": float(np.mean(off > 0.01)),
        }
    return summary
