"""How fast it is: rollouts (with the loss and without) and launches a second, by batch size.

The yardstick is a pull-and-release of its own, so that it runs on a fresh clone: the first band of
params.yaml is grasped where it hangs, lifted, drawn back 0.35 m, held and let go. The clouds that
the loss compares with are points on one simulated band.
"""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import version

import numpy as np
from scipy.stats import qmc

from pipeline.episode import Episode
from pipeline.errors import UserError
from pipeline.identify.evaluate import Evaluator
from pipeline.identify.loss import EpisodeLoss
from pipeline.identify.space import Space
from pipeline.sling.interaction import interact
from pipeline.sling.launch import launch
from pipeline.sling.model import Sling

BATCHES = {"cpu": (16, 64, 128), "cuda": (64, 1024, 16384)}
DRAW = 0.35  # m
GRASP, LIFTED, DRAWN, RELEASE = 1.0, 2.0, 6.0, 8.0  # s


def bench(params, device: str = "cpu") -> list[dict]:
    """One entry a batch size: environments, rollouts/s without and with the loss, launches/s.

    Raises:
        UserError: There is no such device.
    """
    kind = device.partition(":")[0]
    if kind not in BATCHES or not available(device):
        raise UserError(f"device {device}: not there; cpu is, and cuda:0 where there is a GPU")
    band = next(iter(params.bands))
    method = next(iter(params.methods))
    sling = Sling.of(params.bands[band], params.setup, params.sling)
    space = Space.of(params.parameters)
    workers = os.cpu_count() or 1
    episode = pull_and_release(band, params.episode, sling)
    middle = space.to_physical(np.full((1, 5), 0.5))
    lines = interact(sling, episode, middle, device=device).center_line[0]
    episode = replace(episode, clouds=[_points(line, params.cloud.points) for line in lines])
    loss = EpisodeLoss.of(params, method, episode, sling, device=device)
    evaluate = Evaluator(episode, sling, loss, space, device=device, workers=workers)
    draw = np.array([[-DRAW, -0.15]])

    entries = []
    for count in BATCHES[kind]:
        unit = qmc.LatinHypercube(5, rng=1).random(count)
        thetas = space.to_physical(unit)
        work: dict[str, Callable[[], object]] = {
            "rollouts_per_s": lambda t=thetas: interact(
                sling, episode, t, device=device, workers=workers, fetch=False
            ),
            "rollouts_with_loss_per_s": lambda u=unit: evaluate(u),
            "launches_per_s": lambda t=thetas: launch(
                sling, t, draw, device=device, workers=workers
            ),
        }
        if not entries:  # the first run of each compiles
            for run in work.values():
                run()
        entries.append(
            {"environments": count} | {name: count / seconds(run) for name, run in work.items()}
        )
    return entries


def available(device: str) -> bool:
    import warp as wp

    return device in {str(one) for one in wp.get_devices()} | {"cpu"}


def environment(device: str) -> dict:
    """What a figure belongs to: device, its name, command and versions."""
    import warp as wp

    name = platform.processor() or platform.machine()
    if device.startswith("cuda"):
        name = wp.get_device(device).name
    packages = ("warp-lang", "numpy", "scipy")
    return {
        "device": device,
        "device_name": name,
        "cores": os.cpu_count(),
        "command": f"sling bench --device {device} --json",
        "versions": {"python": platform.python_version()}
        | {package: version(package) for package in packages},
    }


def seconds(run: Callable[[], object]) -> float:
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


def pull_and_release(band: str, shape, sling: Sling) -> Episode:
    """The yardstick's interaction, with a camera at 30 Hz that sees nothing yet.

    Args:
        shape: params.yaml's `episode`, of which samples are taken.
    """
    duration = RELEASE + 1.0
    t = (np.arange(shape.samples) + 0.5) * duration / shape.samples
    hang = np.sqrt(max(sling.rest_length**2 / 4 - sling.half_width**2, 0.0))
    lift = 0.5 - 0.5 * np.cos(np.pi * np.clip((t - GRASP) / (LIFTED - GRASP), 0, 1))
    pull = 0.5 - 0.5 * np.cos(np.pi * np.clip((t - LIFTED) / (DRAWN - LIFTED), 0, 1))
    position = np.stack([np.zeros_like(t), -DRAW * pull, hang * (lift - 1)], axis=1)
    cloud_time = np.arange(1, 30 * duration) / 30
    return Episode(
        band=band,
        time=t,
        position=position,
        velocity=np.gradient(position, t, axis=0),
        force=np.zeros_like(position),
        opening=np.full(len(t), np.nan),
        cloud_time=cloud_time,
        clouds=[np.zeros((0, 3), np.float32)] * len(cloud_time),
        grasp_time=GRASP,
        release_time=RELEASE,
        camera=np.array([0.8, 0.3, 0.5]),
    )


def _points(line: np.ndarray, count: int) -> np.ndarray:
    """Points along a centre line, shape (count, 3)."""
    place = np.linspace(0, len(line) - 1, count)
    nodes = np.arange(len(line))
    return np.stack([np.interp(place, nodes, axis) for axis in line.T], axis=1).astype(np.float32)
