"""A killed search goes on where it was: evaluated batches are kept and replayed.

Nothing of an optimiser is saved. It is seeded anew and asks for the same points as before; as long
as they match exactly, their recorded losses are returned instead of simulating again.
"""

from __future__ import annotations

import hashlib
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from pipeline.files import replacing, write_text
from pipeline.identify.evaluate import Evaluation
from pipeline.identify.loss import TERMS


class Recorded:
    """An evaluator that keeps every batch in a folder, and replays those it finds there."""

    def __init__(
        self, evaluate: Callable[[np.ndarray], Evaluation], folder: Path, fingerprint: str
    ) -> None:
        """Open `folder`; batches recorded under another fingerprint are thrown away.

        Args:
            fingerprint: Of everything but the asked point that a loss depends on.
        """
        self.evaluate, self.folder = evaluate, folder
        self._batch = 0
        stamp = folder / "fingerprint"
        if not stamp.is_file() or stamp.read_text(encoding="utf-8") != fingerprint:
            self.clear()
            write_text(stamp, fingerprint)

    def __call__(self, unit: np.ndarray) -> Evaluation:
        """Evaluate points of the unit cube, shape (N, D), or recall their evaluation."""
        unit = np.asarray(unit, float)
        path = self._path(self._batch)
        recalled = load_batch(path) if path.is_file() else None
        if recalled is None or not np.array_equal(recalled.unit, unit):
            self._forget_from(self._batch)
            recalled = self.evaluate(unit)
            save_batch(path, recalled)
        self._batch += 1
        return recalled

    def clear(self) -> None:
        """Remove the folder: the result is complete, or nothing in it is of use."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def _path(self, batch: int) -> Path:
        return self.folder / f"{batch:06d}.npz"

    def _forget_from(self, batch: int) -> None:
        """Drop batches that another course of the search left behind."""
        while self._path(batch).is_file():
            self._path(batch).unlink()
            batch += 1


def save_batch(path: Path, evaluation: Evaluation) -> None:
    arrays = {f"term_{name}": evaluation.terms[name] for name in TERMS}
    failure = np.array([reason or "" for reason in evaluation.failure])
    with replacing(path) as temporary, temporary.open("wb") as file:
        np.savez(
            file,
            unit=evaluation.unit,
            theta=evaluation.theta,
            total=evaluation.total,
            failure=failure,
            **arrays,
        )


def load_batch(path: Path) -> Evaluation | None:
    """The evaluation that `save_batch` wrote; None if the file is damaged."""
    try:
        with np.load(path, allow_pickle=False) as arrays:
            return Evaluation(
                unit=arrays["unit"],
                theta=arrays["theta"],
                terms={name: arrays[f"term_{name}"] for name in TERMS},
                total=arrays["total"],
                failure=[str(reason) or None for reason in arrays["failure"]],
            )
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None


def fingerprint(*parts: str | Path) -> str:
    """Hash of texts and of files' contents; a folder counts with its sources."""
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, str):
            digest.update(b"text" + part.encode())
            continue
        files = [part] if part.is_file() else sorted([*part.glob("*.py"), *part.glob("*.h")])
        for file in files:
            digest.update(file.name.encode() + hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()
