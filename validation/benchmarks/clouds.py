"""How fast a recording becomes clouds: seconds and frames a second of each step, on one core.

Seconds are the process's CPU time, all threads together: what a core of its own would take, however
busy the machine is.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import cv2

from pipeline.params import Params
from pipeline.params.lab import BandParams
from pipeline.recording.cloud import cloud_of
from pipeline.recording.input.reader import Recording, read_recording
from pipeline.recording.masks import masker
from pipeline.recording.processed import Processed
from pipeline.recording.pulls import Pull
from pipeline.recording.view import View
from validation.benchmarks.timing import timed

STEPS = ("decode", "points", "learn", "mask", "cloud")


def bench_recording(path: Path, params: Params) -> dict:
    """Time every step from the file to the clouds, with the first band of params.yaml.

    Returns:
        `frames`: pictures of the window; `one_core`: how the process is kept on one; `read_s`:
        container and messages; `signals_s`: frames, delays, force and events; `per_frame_ms` and
        `frames_per_s` of decode (both pictures), points (frame O, where the band can be), learn
        (what the mask learns once, shared by all frames), mask, cloud (outliers, sampling);
        `frames_per_s_after_decoding`: of all but decode; `points`: the median cloud's.

    Raises:
        UserError: The recording cannot be used.
    """
    band = next(iter(params.bands.values()))
    with on_one_core() as how:
        recording, read, _ = timed(partial(read_recording, Path(path), params.setup))
        view, signals, _ = timed(partial(_view_of, recording, band, params))
        spent, sizes = _steps(view, params.cloud)
    count = max(1, len(sizes))
    after = sum(spent.values()) - spent["decode"]
    return {
        "frames": len(sizes),
        "one_core": how,
        "read_s": read,
        "signals_s": signals,
        "per_frame_ms": {step: 1e3 * spent[step] / count for step in STEPS},
        "frames_per_s": {step: count / spent[step] for step in STEPS},
        "frames_per_s_after_decoding": count / after,
        "points": sorted(sizes)[len(sizes) // 2] if sizes else 0,
    }


def _view_of(recording: Recording, band: BandParams, params: Params) -> View:
    return Processed.of(Pull.of(recording, params.setup), band, params).view


@contextmanager
def on_one_core() -> Iterator[str]:
    """Keep the process, with all threads that it starts, on one core; yields how, in words."""
    if not hasattr(os, "sched_setaffinity"):
        yield "not pinned: this system cannot; set OMP_NUM_THREADS=1"
        return
    allowed, threads = os.sched_getaffinity(0), cv2.getNumThreads()
    core = min(allowed)
    os.sched_setaffinity(0, {core})
    cv2.setNumThreads(1)
    try:
        yield f"sched_setaffinity to core {core}"
    finally:
        os.sched_setaffinity(0, allowed)
        cv2.setNumThreads(threads)


def _steps(view: View, cloud: object) -> tuple[dict[str, float], list[int]]:
    """CPU seconds of each step over all frames, and the size of each cloud."""
    spent, sizes = dict.fromkeys(STEPS, 0.0), []
    mask, spent["learn"], _ = timed(partial(masker, cloud.mask, view, cloud.sam3))
    for number in range(len(view)):
        pictures, seconds, _ = timed(lambda k=number: (view.depth(k), view.color(k)))
        spent["decode"] += seconds
        if any(picture is None for picture in pictures):
            continue
        frame, seconds, _ = timed(partial(view.rgbd_frame, number, *pictures))
        spent["points"] += seconds
        band_mask, seconds, _ = timed(partial(mask.mask, frame))
        spent["mask"] += seconds
        points, seconds, _ = timed(partial(cloud_of, view, frame, band_mask, cloud))
        spent["cloud"] += seconds
        sizes.append(len(points))
    return spent, sizes


def table(result: dict) -> str:
    """What `bench_recording` found, as lines for people."""
    lines = [
        f"{result['frames']} frames, {result['one_core']}",
        f"read {result['read_s']:.2f} s, signals {result['signals_s']:.2f} s",
        f"{'':8}{'ms a frame':>12}{'frames/s':>12}",
    ]
    for step in STEPS:
        each, rate = result["per_frame_ms"][step], result["frames_per_s"][step]
        lines.append(f"{step:8}{each:12.1f}{rate:12.0f}")
    lines.append(
        f"after decoding {result['frames_per_s_after_decoding']:.0f} frames/s,"
        f" {result['points']} points a cloud"
    )
    return "\n".join(lines)
