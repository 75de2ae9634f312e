"""Run bands in PhysX: write a job, let a process of its own simulate it, read what came back."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.engines.physx import scene, worker
from sling2sim2real.engines.physx.scene import Drive
from sling2sim2real.exporting.mesh import Tube

Steer = Callable[[np.ndarray], np.ndarray | None]
LARGEST_PLACE_M = 10.0  # m: a band that leaves it has burst
BURST = "the band burst in PhysX"
INTERPRETER = "SLING_PHYSX"  # the Python that has ovphysx; this one by default
PACKAGES = "'ovphysx>=0.7,<0.8' physx-usd-schemas newton-usd-schemas"  # extra `physx`
ASK = """
from importlib.metadata import version
for name in ("ovstage", "physx-usd-schemas", "newton-usd-schemas", "warp-lang", "ovphysx"):
    found = version(name)
print(found)
"""


class Engine:
    """PhysX in a process of its own, which simulates one scene after the other.

    Raises UserError, here and in `simulate`: PhysX is not installed, or there is no GPU, or it
    failed.
    """

    def __init__(self) -> None:
        release()
        self._said = tempfile.TemporaryFile("w+")
        self._process: Any = subprocess.Popen(  # whose streams are there
            [_python(), str(Path(worker.__file__))],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said, text=True,
        )  # fmt: skip

    def __enter__(self) -> Engine:
        return self

    def __exit__(self, *_) -> None:
        self._process.kill()
        self._process.wait()
        self._said.close()

    def simulate(self, tube: Tube, thetas: np.ndarray, phases: list[Drive]) -> list[np.ndarray]:
        """Bands of the thetas (N, 5), each from the straight U in which `tube` hangs.

        Returns:
            Of each phase the nodes' places after the steps kept [m], (K, N, sections, V, 3).
        """
        start = np.tile(tube.hanging.reshape(-1, 3), (len(thetas), 1, 1))
        done = self.run(scene.text(tube, thetas), scene.job(tube, start, phases))
        shape = (-1, len(thetas), *tube.rest.shape)
        return [done[f"positions_{i}"].reshape(shape).astype(float) for i in range(len(phases))]

    def run(self, text: str, job: dict, steer: Steer | None = None) -> dict[str, np.ndarray]:
        """What the worker makes of a scene in USD's text form and of a `scene.job`.

        Args:
            steer: Goes on with the last phase: from the nodes' places (N, nodes, 3) [m] to the
                targets (N, D, 3) at the end of the next step, or None, which ends it.
        """
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            (folder / "scene.usda").write_text(text)
            np.savez(folder / "job.npz", **job, steered=steer is not None)
            self._work(folder, steer)
            return dict(np.load(folder / "result.npz"))

    def _work(self, folder: Path, steer: Any) -> None:
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
