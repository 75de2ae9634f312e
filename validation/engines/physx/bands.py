"""Run bands in PhysX: write a job, let a process of its own simulate it, read what came back."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.base.errors import UserError
from validation.engines.mesh import Tube
from validation.engines.physx import scene

INTERPRETER = "SLING_PHYSX"  # the Python that has ovphysx; this one by default
PACKAGES = "'ovphysx>=0.7,<0.8' physx-usd-schemas newton-usd-schemas"  # extra `physx`
ASK = """
from importlib.metadata import version
for name in ("ovstage", "physx-usd-schemas", "newton-usd-schemas", "warp-lang", "ovphysx"):
    found = version(name)
print(found)
"""


@dataclass(frozen=True)
class Drive:
    """A phase in which some vertices are led along a path; the others are free.

    Attributes:
        vertices: Those that are led, shape (D,).
        targets: Where they are at the end of each step [m], shape (S, D, 3), in every band.
        fade: How much of their distance from targets[0] at the phase's begin is left, shape (S,).
        keep: Steps after which the nodes' places are kept, shape (S,), bool.
    """

    vertices: np.ndarray
    targets: np.ndarray
    fade: np.ndarray
    keep: np.ndarray


@dataclass(frozen=True)
class Course:
    """A simulated phase of N bands.

    Attributes:
        positions: Of the vertices after the steps kept [m], shape (K, N, sections, V, 3).
        velocities: At the end [m/s], shape (N, sections, V, 3).
        seconds: That stepping took, and what was kept to read.
        attach_seconds: That it took to load the scene for this phase.
    """

    positions: np.ndarray
    velocities: np.ndarray
    seconds: float
    attach_seconds: float


def simulate(
    tube: Tube, thetas: np.ndarray, phases: list[Drive], *, rate: int, iterations: int
) -> list[Course]:
    """Bands of the thetas (N, 5), each from the straight U in which `tube` hangs.

    Args:
        rate: Steps a second.
        iterations: Of the solver a step.

    Raises:
        UserError: PhysX is not installed, or there is no GPU, or it failed.
    """
    thetas = np.atleast_2d(np.asarray(thetas, float))
    job = {
        "step": 1 / rate,
        "phases": len(phases),
        "offsets": scene.offsets(len(thetas)),
        "rest": tube.rest.reshape(-1, 3),
        "start": np.tile(tube.hanging.reshape(-1, 3), (len(thetas), 1, 1)),
    }
    for i, phase in enumerate(phases):
        job |= {f"{name}_{i}": value for name, value in vars(phase).items()}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "scene.usda").write_text(scene.text(tube, thetas, rate, iterations))
        np.savez(folder / "job.npz", **job)
        _call(str(Path(__file__).with_name("worker.py")), name)
        done = dict(np.load(folder / "result.npz"))
    return [
        Course(
            done[f"positions_{i}"].reshape(-1, len(thetas), *tube.rest.shape).astype(float),
            done[f"velocities_{i}"].reshape(-1, *tube.rest.shape).astype(float),
            float(done[f"seconds_{i}"]),
            float(done[f"attach_seconds_{i}"]),
        )
        for i in range(len(phases))
    ]


def release() -> str:
    """Version of ovphysx. Raises UserError where it is not installed."""
    return _call("-c", ASK).strip()


def _call(*arguments: str) -> str:
    """What the interpreter with PhysX prints. Raises UserError with its last line."""
    python = os.environ.get(INTERPRETER) or sys.executable
    try:
        done = subprocess.run([python, *arguments], capture_output=True, text=True)
    except OSError as error:
        raise UserError(f"{INTERPRETER}={python}: {error.strerror}") from error
    if done.returncode:
        said = [line for line in done.stderr.splitlines() if line.strip()] or ["no reason given"]
        if "NotFoundError" in said[-1]:
            raise UserError(
                f"PhysX is not installed ({said[-1].partition(': ')[2]}): make an environment of"
                f" its own, pip install {PACKAGES} there, and set {INTERPRETER} to its python"
            )
        raise UserError(f"PhysX: {said[-1]}")
    return done.stdout
