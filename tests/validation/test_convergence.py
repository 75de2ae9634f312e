"""Are the default steps and mesh fine enough for a launch? Against finer ones, at random θ."""

from __future__ import annotations

import os
import time
from dataclasses import replace

import numpy as np
import pytest

from pipeline.sling import Launches, Sling, launch

pytestmark = pytest.mark.validation

COUNT, SEED = 20, 3
RANGES = {  # of what a launch depends on: friction belongs to the pads, which a launch has not
    "youngs_modulus": (1e5, 1e6),
    "poissons_ratio": (0.30, 0.49),
    "elasticity_damping": (3e-4, 1.6e-2),
    "damping_scale": (0.0, 1.0),
}
DRAW_Y, DRAW_Z = (-0.45, -0.30), (-0.30, -0.10)
REFINE, MESH = 10, 4
TIME_LIMIT, MESH_LIMIT = 0.5, 1.0  # % of speed


def random_launches() -> tuple[np.ndarray, np.ndarray]:
    """Thetas (COUNT, 5), those with several decades on a log scale, and draws (COUNT, 2)."""
    rng = np.random.default_rng(SEED)

    def uniform(low: float, high: float, log: bool = False) -> np.ndarray:
        if log:
            return np.exp(rng.uniform(np.log(low), np.log(high), COUNT))
        return rng.uniform(low, high, COUNT)

    theta = np.column_stack(
        [
            uniform(*RANGES["youngs_modulus"], log=True),
            uniform(*RANGES["poissons_ratio"]),
            uniform(*RANGES["elasticity_damping"], log=True),
            np.full(COUNT, 0.5),
            uniform(*RANGES["damping_scale"]),
        ]
    )
    return theta, np.column_stack([uniform(*DRAW_Y), uniform(*DRAW_Z)])


def differences(default: Launches, finer: Launches) -> dict:
    """What the default is off from the finer one, in % of the finer one, where both succeed."""
    both = np.isfinite(default.speed) & np.isfinite(finer.speed)

    def off(one: np.ndarray, other: np.ndarray) -> dict:
        percent = 100 * (one[both] / other[both] - 1)
        return {
            "max_abs_percent": np.abs(percent).max(),
            "mean_abs_percent": np.abs(percent).mean(),
            "mean_percent": percent.mean(),
        }

    return {
        "launches": int(both.sum()),
        "speed": off(default.speed, finer.speed),
        "landing": off(default.landing_y, finer.landing_y),
        "hold_force": off(default.hold_force, finer.hold_force),
    }


def test_launches_are_converged_in_time_and_mesh(params, progress, record) -> None:
    band = next(iter(params.bands))
    sling = Sling.of(params.bands[band], params.setup, params.sling)
    fine_mesh = params.sling.model_copy(update={"edges": MESH * params.sling.edges})
    mesh = replace(sling, edges=fine_mesh.edges, steps=fine_mesh)
    thetas, draws = random_launches()
    exact = {"refine": REFINE, "double": True}
    runs = {
        "default": (sling, {}),
        "finer_steps": (sling, exact),
        "finer_mesh": (mesh, {"double": True}),
        "finer_both": (mesh, exact),
    }
    progress("")
    done, wall = {}, {}
    for name, (one, options) in runs.items():
        start = time.perf_counter()
        done[name] = launch(one, thetas, draws, workers=os.cpu_count() or 1, **options)
        wall[name] = time.perf_counter() - start
        progress(f"  {name}: {wall[name]:.1f} s")
    failures = {
        name: {k: reason for k, reason in enumerate(one.failure) if reason is not None}
        for name, one in done.items()
    }
    off = {name: differences(done["default"], done[name]) for name in list(runs)[1:]}
    in_time = off["finer_steps"]["speed"]["max_abs_percent"]
    in_mesh = off["finer_mesh"]["speed"]["max_abs_percent"]
    met = not any(failures.values()) and in_time <= TIME_LIMIT and in_mesh <= MESH_LIMIT
    record(
        "convergence",
        asked=f"{COUNT} launches at random θ with the default resolution: the speed is within"
        f" {TIME_LIMIT} % of that with {REFINE} times finer steps in double precision, and within"
        f" {MESH_LIMIT} % of that on a mesh with {MESH} times as many edges, also in double.",
        met=bool(met),
        settings={
            "seed": SEED,
            "band": {"name": band, **params.bands[band].model_dump()},
            "theta": RANGES,
            "draw_y_m": DRAW_Y,
            "draw_z_m": DRAW_Z,
            "sling": params.sling.model_dump(),
            "projectile_mass_kg": sling.projectile_mass,
            "refine": REFINE,
            "finer_mesh_edges": mesh.edges,
        },
        figures={"default_is_off_from": off, "failures": failures, "wall_seconds": wall},
    )
    assert not any(failures.values()), failures
    assert in_time <= TIME_LIMIT
    assert in_mesh <= MESH_LIMIT
