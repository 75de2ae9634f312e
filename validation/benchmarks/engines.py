"""How fast other engines are at the yardstick of `sling bench`, how right, and how we compare."""

from __future__ import annotations

from importlib.metadata import version

import numpy as np
from scipy.stats import qmc

from pipeline.base.errors import UserError
from pipeline.export.mesh import Tube, hand_path
from pipeline.identify.objective.box import SearchBox
from pipeline.params import Params
from pipeline.simulator.interaction import interact
from pipeline.simulator.model import ClampedBand
from pipeline.simulator.parameters import Parameters
from validation.benchmarks.timing import available, timed
from validation.engines import mujoco_flex
from validation.engines.newton_vbd import Bands
from validation.simulator.closed import String
from validation.synthetic import DRAWN, pull_and_release, yardstick

THETA = np.array([2.2e5, 0.45, 3e-3, 1.0, 1.0])  # 11 N at a draw of 0.35 m
PEER_STEP = 0.005  # s: the largest that stays close while gripped; free, it loses launch speed
VBD_ITERATIONS = 64
ENVIRONMENTS = {"cpu": (64, 1), "cuda": (1024, 1024)}  # ours, Newton's
TIMED_STEPS = 20  # of Newton, on a GPU


def bench_peers(params: Params, device: str = "cpu") -> list[dict]:
    """One entry an engine and device: settings, cost, `ratio` to ours there, force error.

    On a CPU the cost is CPU seconds a rollout, on a GPU rollouts a second; a ratio above 1 is how
    many times slower than ours an engine is there. The force error is that of the held, drawn band
    against a straight string's closed form.

    Raises:
        UserError: There is no such device.
    """
    kind = device.partition(":")[0]
    if kind not in ENVIRONMENTS or not available(device):
        raise UserError(f"device {device}: not there; cpu is, and cuda:0 where there is a GPU")
    band = params.bands[next(iter(params.bands))]
    sling = yardstick(band, params)
    episode = pull_and_release(next(iter(params.bands)), params.episode, sling)
    box = SearchBox.of(params.parameters)
    core = _ours(sling, episode, box, "cpu")
    entries = [core, _mujoco(sling, episode, core)]
    here = core
    if kind == "cuda":
        here = _ours(sling, episode, box, device)
        entries.append(here)
    return [*entries, _newton(sling, episode, here, device)]


def _ours(sling: ClampedBand, episode, box: SearchBox, device: str) -> dict:
    held = interact(sling, episode, Parameters.of(sling.law, THETA), device=device)
    force = held.force[0, np.searchsorted(held.times, episode.release_time) - 1]
    kind = device.partition(":")[0]
    count = ENVIRONMENTS[kind][0]
    parameters = box.parameters(box.to_physical(qmc.LatinHypercube(5, rng=1).random(count)))
    _, cpu, wall = timed(lambda: interact(sling, episode, parameters, device=device))
    return _entry(
        "sling", f"warp {version('warp-lang')}", device, (cpu if kind == "cpu" else wall) / count,
        f"{count} random thetas at once, {sling.edges} edges, {len(held.times)} steps",
        _force_error(sling, episode, force),
    )  # fmt: skip


def _mujoco(sling: ClampedBand, episode, ours: dict) -> dict:
    try:
        result, cpu, _ = timed(lambda: mujoco_flex.interact(sling, episode, THETA, PEER_STEP))
    except UserError as error:
        return {"name": "mujoco", "device": "cpu", "note": str(error)}
    whole = episode.time[-1] - episode.grasp_time
    held = episode.release_time - episode.grasp_time
    return _entry(
        "mujoco", version("mujoco"), "cpu", cpu * whole / held,
        f"3D flex of 900 tetrahedra, stable neo-Hookean, discrete, {PEER_STEP:g} s; timed from the"
        f" grasp to the release, {held / whole:.0%} of it",
        _force_error(sling, episode, result.force[-1]),
        ours,
    )  # fmt: skip


def _newton(sling: ClampedBand, episode, ours: dict, device: str) -> dict:
    kind = device.partition(":")[0]
    count = ENVIRONMENTS[kind][1]
    whole = int(round((episode.time[-1] - episode.grasp_time) / PEER_STEP))
    drawn = int(round((DRAWN + 0.2 - episode.grasp_time) / PEER_STEP)) // 2 * 2
    times = episode.grasp_time + PEER_STEP * np.arange(1, drawn + 1)
    tube = Tube.of(sling, grading=1.0)  # short edges are slow to converge
    path = hand_path(episode, times, tube.clamped[tube.middle, 0])
    options = {"step": PEER_STEP, "iterations": VBD_ITERATIONS, "device": device}
    try:
        single_band = Bands(tube, THETA, 1, path, **options)
        single_band.run(4)  # compiles
        _, cpu, wall = timed(lambda: single_band.run(drawn - 4))
        per_step, counted = cpu / (drawn - 4), drawn - 4
        if kind == "cuda":
            many = Bands(tube, THETA, count, path, **options)
            many.run(4)
            _, _, wall = timed(lambda: many.run(TIMED_STEPS))
            per_step, counted = wall / TIMED_STEPS / count, TIMED_STEPS
    except UserError as error:
        return {"name": "newton", "device": device, "note": str(error)}
    return _entry(
        "newton", version("newton"), device, per_step * whole,
        f"VBD, {count} x 900 tetrahedra, {VBD_ITERATIONS} iterations, {PEER_STEP:g} s; timed"
        f" {counted} of {whole} steps",
        _force_error(sling, episode, single_band.forces()[0]),
        ours,
    )  # fmt: skip


def _entry(name, release, device, seconds, settings, force_error, ours=None) -> dict:
    on_cpu = device == "cpu"
    return {
        "name": name,
        "version": release,
        "device": device,
        "settings": settings,
        "cpu_s_per_rollout" if on_cpu else "rollouts_per_s": seconds if on_cpu else 1 / seconds,
        "ratio": seconds / _seconds_of(ours) if ours else 1.0,
        "force_error": force_error,
    }


def _seconds_of(entry: dict) -> float:
    return entry.get("cpu_s_per_rollout") or 1 / entry["rollouts_per_s"]


def table(entries: list[dict]) -> str:
    """Lines for people."""
    lines = []
    for entry in entries:
        head = f"{entry['name']} on {entry['device']}: "
        if "note" in entry:
            lines.append(head + entry["note"])
            continue
        cost = (
            f"{entry['cpu_s_per_rollout']:.3g} CPU-s a rollout"
            if "cpu_s_per_rollout" in entry
            else f"{entry['rollouts_per_s']:.3g} rollouts/s"
        )
        lines.append(
            f"{head}{cost}, {entry['ratio']:.0f} x ours, force {entry['force_error']:+.1%}"
            f" ({entry['version']}; {entry['settings']})"
        )
    return "\n".join(lines)


def _force_error(sling: ClampedBand, episode, force: np.ndarray) -> float:
    """Relative error of the drawn band's force on the hand, against straight, weightless halves."""
    hand = episode.position[np.searchsorted(episode.time, episode.release_time) - 1]
    legs = sling.tips - hand
    lengths = np.linalg.norm(legs, axis=1, keepdims=True)
    pull = String.of(sling, THETA).force(2 * lengths / sling.rest_length)
    return float(np.linalg.norm(force) / np.linalg.norm((pull * legs / lengths).sum(axis=0)) - 1)
