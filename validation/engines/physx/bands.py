"""Run bands in PhysX: write a job, let a process of its own simulate it, read what came back."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.base.errors import UserError
from pipeline.export.mesh import Tube
from validation.engines.physx import scene, worker

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
        targets: Where they are at the end of each step [m], shape (S, D, 3) in every band, or
            (S, N, D, 3), one for each; with (1, ...) for all steps.
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


class Engine:
    """PhysX in a process of its own, which simulates one scene after the other.

    Raises UserError, here and in `simulate`: PhysX is not installed, or there is no GPU, or it
    failed.
    """

    def __init__(self) -> None:
        release()
        self._said = tempfile.TemporaryFile("w+")
        self._process = subprocess.Popen(
            [_python(), str(Path(worker.__file__))],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said, text=True,
        )  # fmt: skip

    def __enter__(self) -> Engine:
        return self

    def __exit__(self, *_) -> None:
        self._process.kill()
        self._process.wait()
        self._said.close()

    def simulate(
        self,
        tube: Tube,
        thetas: np.ndarray,
        phases: list[Drive],
        *,
        rate: int,
        iterations: int,
        steer: Callable[[np.ndarray], np.ndarray | None] | None = None,
    ) -> list[Course]:
        """Bands of the thetas (N, 5), each from the straight U in which `tube` hangs.

        Args:
            rate: Steps a second.
            iterations: Of the solver a step.
            steer: Goes on with the last phase: from the nodes' places (N, sections, V, 3) [m] to
                the targets (N, D, 3) at the end of the next step, or None, which ends it.
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
        shape = (len(thetas), *tube.rest.shape)
        led = steer and (lambda nodes: steer(nodes.reshape(shape).astype(float)))
        done = self.run(scene.text(tube, thetas, rate, iterations), job, led)
        return [
            Course(
                done[f"positions_{i}"].reshape(-1, len(thetas), *tube.rest.shape).astype(float),
                done[f"velocities_{i}"].reshape(-1, *tube.rest.shape).astype(float),
                float(done[f"seconds_{i}"]),
                float(done[f"attach_seconds_{i}"]),
            )
            for i in range(len(phases))
        ]

    def run(self, text: str, job: dict, steer=None) -> dict[str, np.ndarray]:
        """What the worker makes of a scene in USD's text form and of a job like `simulate`'s.

        `steer` is `simulate`'s, but for the nodes' shape (N, sections V, 3).
        """
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            (folder / "scene.usda").write_text(text)
            np.savez(folder / "job.npz", **job, steered=steer is not None)
            self._work(folder, steer)
            return dict(np.load(folder / "result.npz"))

    def _work(self, folder: Path, steer) -> None:
        self._say(folder)
        for line in self._process.stdout:  # PhysX has words of its own there
            if line.strip() == worker.DONE:
                return
            if line.strip() == worker.NEXT:
                targets = steer(np.load(folder / "nodes.npy"))
                if targets is not None:
                    np.save(folder / "targets.npy", targets)
                self._say("no more" if targets is None else worker.ON)
        self._said.seek(0)
        raise UserError(f"PhysX: {_last_line(self._said.read())}")

    def _say(self, line: object) -> None:
        with suppress(BrokenPipeError):
            self._process.stdin.write(f"{line}\n")
            self._process.stdin.flush()


def release() -> str:
    """Version of ovphysx. Raises UserError where it is not installed."""
    return _call("-c", ASK).strip()


def _call(*arguments: str) -> str:
    """What the interpreter with PhysX prints. Raises UserError with its last line."""
    python = _python()
    try:
        done = subprocess.run([python, *arguments], capture_output=True, text=True)
    except OSError as error:
        raise UserError(f"{INTERPRETER}={python}: {error.strerror}") from error
    if done.returncode:
        message = _last_line(done.stderr)
        if "NotFoundError" in message:
            raise UserError(
                f"PhysX is not installed ({message.partition(': ')[2]}): make an environment of"
                f" its own, pip install {PACKAGES} there, and set {INTERPRETER} to its python"
            )
        raise UserError(f"PhysX: {message}")
    return done.stdout


def _python() -> str:
    return os.environ.get(INTERPRETER) or sys.executable


def _last_line(text: str) -> str:
    return ([line for line in text.splitlines() if line.strip()] or ["no reason given"])[-1]
