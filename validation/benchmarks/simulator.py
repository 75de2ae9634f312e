"""How fast it is: rollouts (with the loss and without) and launches a second, by batch size.

The yardstick is a pull-and-release of its own, so that it runs on a fresh clone: the first band of
params.yaml is grasped where it hangs, lifted, drawn back 0.35 m, held, and let go at 8.1 of 9 s.
What the loss compares with is one simulated band: its filtered force, and points on its ridge.
"""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from importlib.metadata import version
from pathlib import Path

import numpy as np
from scipy.stats import qmc

import pipeline.sling
from pipeline.base.fingerprint import fingerprint
from pipeline.base.machine import commit, gpus, named, processor
from pipeline.episode.episode import Episode
from pipeline.objective.evaluate import Evaluator
from pipeline.objective.loss import EpisodeLoss
from pipeline.objective.space import Space
from pipeline.sling.interaction import interact, schedule_of
from pipeline.sling.launch import launch
from pipeline.sling.layout import Grip
from pipeline.sling.model import Sling
from pipeline.sling.schedule import RELAX_STEPS
from pipeline.sling.solver import Options, memory

BATCHES = {"cpu": (64, 256), "cuda": (64, 1024, 16384)}
DRAW = 0.35  # m
THETA = (2e5, 0.45, 2e-3, 0.5, 0.5)  # of the band that is recorded
GRASP, LIFTED, DRAWN, RELEASE, DURATION = 1.0, 2.0, 6.0, 8.1, 9.0  # s
SIMULATOR = fingerprint(Path(pipeline.sling.__file__).parent)[:12]  # as it is imported
REPEATS = 3  # the best of them counts: others may use the machine too


def bench(params, device: str = "cpu") -> dict:
    """Time the yardstick.

    Args:
        device: Or several that share each batch, as SLING_DEVICE names them.

    Returns:
        `batches`: environments, threads on the CPU, rollouts/s without and with the loss,
        launches/s; `yardstick`: its steps, the mean of its Newton iterations, bytes a rollout;
        `first_start_s`: a first rollout with nothing compiled yet, and the next start's.

    Raises:
        UserError: There is no such device.
    """
    devices = named(device, "--device")
    kind = devices[0].partition(":")[0]
    sling, episode = recorded_yardstick(params)
    space = Space.of(params.parameters)
    loss = EpisodeLoss.of(params, next(iter(params.methods)), episode, sling)
    simulate = partial(shared, devices, partial(interact, sling, episode, fetch=False))
    shoot = partial(launch, sling, draws=np.array([[-DRAW, -0.15]]), device=devices)

    batches = []
    for count in BATCHES[kind]:
        unit = qmc.LatinHypercube(5, rng=1).random(count)
        thetas = space.to_physical(unit)
        for workers in sorted({1, os.cpu_count() or 1} if kind == "cpu" else {1}):
            evaluate = Evaluator(episode, sling, loss, space, devices=devices, workers=workers)
            evaluate(unit[: len(devices)]), shoot(thetas[:1])  # what compiles
            batches.append(
                {
                    "environments": count,
                    "threads": workers,
                    "rollouts_per_s": count / seconds(partial(simulate, thetas, workers=workers)),
                    "rollouts_with_loss_per_s": count / seconds(partial(evaluate, unit)),
                    "launches_per_s": count / seconds(partial(shoot, thetas, workers=workers)),
                }
            )
    iterations = np.mean([part.iterations.mean() for part in simulate(thetas)])
    schedule = schedule_of(sling, episode)
    return {
        "batches": batches,
        "yardstick": {
            "steps": steps_of(schedule),
            "newton_iterations": round(float(iterations)),
            "bytes_a_rollout": memory(
                sling, schedule, len(episode.cloud_time), Options(devices[0])
            ),
        },
        "first_start_s": first_start(devices[0]),
    }


def shared(devices: Sequence[str], simulate: Callable, thetas: np.ndarray, **options) -> list:
    """What `simulate` gives for each device's share of thetas (N, 5), all at once."""
    with ThreadPoolExecutor(len(devices)) as pool:
        return list(
            pool.map(
                lambda device, share: simulate(share, device=device, **options),
                devices,
                np.array_split(thetas, len(devices)),
            )
        )


def steps_of(schedule) -> dict[str, int]:
    """How many steps each phase of a schedule has."""
    h, grip = schedule.steps["h"][RELAX_STEPS:], schedule.steps["grip"][RELAX_STEPS:]
    free = grip == Grip.FREE
    fine = free & (h <= h[free][0] * 1.001)
    return {
        "relaxation": RELAX_STEPS,
        "held": int((grip == Grip.HELD).sum()),
        "fingers_opening": int((grip == Grip.OPENING).sum()),
        "recoil": int(fine.sum()),
        "swing": int((free & ~fine).sum()),
    }


def first_start(device: str) -> dict[str, float]:
    """Seconds that a new process needs for one launch: with an empty kernel cache, and again."""
    code = (
        "from pipeline.params import load; from pipeline.sling import Sling, launch; p = load();"
        "b = next(iter(p.bands.values())); launch(Sling.of(b, p.setup, p.sling),"
        f" [3e5, 0.45, 2e-3, 0.5, 1.0], [-0.38, -0.2], device={device!r})"
    )
    with tempfile.TemporaryDirectory() as cache:
        start = partial(
            subprocess.run,
            [sys.executable, "-c", code],
            env=os.environ | {"WARP_CACHE_PATH": cache},
            check=True,
            capture_output=True,
        )
        return {name: round(seconds(start, 1), 2) for name in ("empty_cache", "cached")}


def yardstick(band, params) -> Sling:
    """A band in pads that let no theta slip, so that every rollout goes on to its end."""
    return replace(Sling.of(band, params.setup, params.sling), grip_force=1e5)


def available(device: str) -> bool:
    return device in {"cpu", *gpus()}


def environment(device: str, command: str = "") -> dict:
    """What a figure belongs to: device, its name, command, versions, commit and simulator.

    `simulator` is a digest of pipeline/sling, which tells also where there is no git.
    """
    import warp as wp

    devices, name = named(device, "--device"), processor()
    if device != "cpu":
        name = wp.get_device(devices[0]).name
    packages = ("warp-lang", "numpy", "scipy")
    return {
        "device": device,
        "device_name": name,
        "devices": len(devices),
        "cores": os.cpu_count(),
        "command": command or f"sling bench --device {device} --json",
        "commit": commit(Path(__file__).parent),
        "simulator": SIMULATOR,
        "versions": {"python": platform.python_version()}
        | {package: version(package) for package in packages},
    }


def seconds(run: Callable[[], object], repeats: int = REPEATS) -> float:
    """The best of some runs."""
    return min(timed(run)[2] for _ in range(repeats))


def timed(work: Callable[[], object]) -> tuple:
    """What `work` returns, and its CPU and wall time [s]."""
    cpu, wall = time.process_time(), time.perf_counter()
    result = work()
    return result, time.process_time() - cpu, time.perf_counter() - wall


def pull_and_release(band: str, shape, sling: Sling) -> Episode:
    """The yardstick's interaction, with a camera at 30 Hz that sees nothing yet.

    Args:
        shape: params.yaml's `episode`, of which samples are taken.
    """
    t = (np.arange(shape.samples) + 0.5) * DURATION / shape.samples
    hang = np.sqrt(max(sling.rest_length**2 / 4 - sling.half_width**2, 0.0))
    lift, pull = ease(t, GRASP, LIFTED), ease(t, LIFTED, DRAWN)
    position = np.stack([np.zeros_like(t), -DRAW * pull, hang * (lift - 1)], axis=1)
    return unseen(band, t, position, np.arange(1, 30 * DURATION) / 30, GRASP, RELEASE)


def ease(t: np.ndarray, first: float, last: float) -> np.ndarray:
    """From 0 at `first` to 1 at `last`, half a cosine."""
    return 0.5 - 0.5 * np.cos(np.pi * np.clip((t - first) / (last - first), 0, 1))


def unseen(
    band: str,
    time: np.ndarray,
    position: np.ndarray,
    cloud_time: np.ndarray,
    grasp_time: float,
    release_time: float,
) -> Episode:
    """A motion of the hand (T,), (T, 3) whose force and clouds nobody measured."""
    return Episode(
        band=band,
        time=time,
        position=position,
        velocity=np.gradient(position, time, axis=0),
        force=np.zeros_like(position),
        opening=np.full(len(time), np.nan),
        cloud_time=cloud_time,
        clouds=[np.zeros((0, 3), np.float32)] * len(cloud_time),
        grasp_time=grasp_time,
        release_time=release_time,
        camera=np.array([0.8, 0.3, 0.5]),
    )


def recorded_yardstick(params) -> tuple[Sling, Episode]:
    """The first band, pulled and released with THETA, as sensors without noise would record it."""
    band = next(iter(params.bands))
    sling = yardstick(params.bands[band], params)
    episode = pull_and_release(band, params.episode, sling)
    rollout = interact(sling, episode, np.array([THETA]))
    ridges = [
        _ridge(line, sling.radius, episode.camera, params.cloud.points)
        for line in rollout.center_line[0]
    ]
    episode = replace(episode, clouds=ridges)
    return sling, replace(
        episode, force=EpisodeLoss.plain(params, episode, sling).filtered(rollout)[0]
    )


def _ridge(line: np.ndarray, radius: float, camera: np.ndarray, count: int) -> np.ndarray:
    """Points where a tube around a centre line is nearest to the camera, shape (count, 3)."""
    place = np.linspace(0, len(line) - 1, count)
    nodes = np.arange(len(line))
    points = np.stack([np.interp(place, nodes, axis) for axis in line.T], axis=1)
    towards = camera - points
    points += radius * towards / np.linalg.norm(towards, axis=1, keepdims=True)
    return points.astype(np.float32)


def table(result: dict) -> str:
    """What `bench` found, as lines for people."""
    rows = result["batches"]
    lines = ["  ".join(rows[0])]
    lines += ["  ".join(f"{value:{len(key)}.0f}" for key, value in row.items()) for row in rows]
    steps, yardstick = result["yardstick"]["steps"], result["yardstick"]
    lines += [
        "",
        "a rollout: " + ", ".join(f"{name} {n}" for name, n in steps.items()) + " steps;",
        f"{yardstick['newton_iterations']} Newton iterations;"
        f" {yardstick['bytes_a_rollout'] / 1024:.0f} KiB",
        "first start {empty_cache:.1f} s, then {cached:.1f} s".format(**result["first_start_s"]),
    ]
    return "\n".join(lines)
