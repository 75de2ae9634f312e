"""What was simulated is remembered: a batch that is asked for again is recalled from disk.

So a killed search goes on where it was (seeded anew, its optimiser asks for the same points), and
methods that ask for the same points share their simulations. Kept are the terms of the loss, from
which each method's weights give its total.
"""

from __future__ import annotations

import hashlib
import shutil
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np

from pipeline.base.errors import one_line
from pipeline.base.files import replacing
from pipeline.identify.objective.evaluate import NOT_FINITE, Evaluation, Evaluator, weighed
from pipeline.identify.objective.loss import TERMS

ARRAYS = ("theta", "failure", "weighed", *(f"term_{name}" for name in TERMS))  # of a file


class EvaluationCache:
    """An evaluator that looks into a folder before it simulates."""

    def __init__(self, evaluate: Evaluator, folder: Path, fingerprint: str) -> None:
        """Open `folder`; what another fingerprint left there is thrown away.

        Args:
            fingerprint: Of everything but the points that a term of the loss depends on.
        """
        self.evaluate, self.folder = evaluate, folder / fingerprint[:16]
        weights = evaluate.loss.weights
        self._weighed = sorted(name for name in weights if weights[name])
        if folder.is_dir():
            for other in folder.iterdir():
                if other != self.folder:
                    shutil.rmtree(other, ignore_errors=True)

    def __call__(self, unit: np.ndarray) -> Evaluation:
        """Evaluate points of the unit cube, shape (N, D), or recall their evaluation."""
        unit = np.array(unit, float)
        theta = self.evaluate.box.to_physical(unit)
        path = self.folder / f"{self._key(theta)}.npz"
        evaluation = self._recalled(path, unit, theta)
        if evaluation is None:
            evaluation = self.evaluate(unit)
            with suppress(FileNotFoundError):  # another run has just thrown the folder away
                self._keep(path, evaluation)
        return evaluation

    def _key(self, theta: np.ndarray) -> str:
        """Hash physical points: another box of the search may hold the same ones."""
        text = " ".join(self.evaluate.box.names).encode()
        return hashlib.sha256(text + theta.tobytes()).hexdigest()[:32]

    def _keep(self, path: Path, evaluation: Evaluation) -> None:
        with replacing(path) as temporary, temporary.open("wb") as file:
            np.savez(
                file,
                allow_pickle=False,
                theta=evaluation.theta,
                failure=np.array([reason or "" for reason in evaluation.failure]),
                weighed=np.array(self._weighed),
                **{f"term_{name}": evaluation.terms[name] for name in TERMS},
            )

    def _recalled(self, path: Path, unit: np.ndarray, theta: np.ndarray) -> Evaluation | None:
        """The evaluation of these points under this method's weights; None: simulate them."""
        if not path.is_file():
            return None
        try:
            with np.load(path, allow_pickle=False) as file:
                arrays = {name: file[name] for name in ARRAYS}
        except FileNotFoundError:  # another run has just thrown the folder away
            return None
        except Exception as error:  # a zip file can be damaged in many ways
            why = f"damaged ({one_line(error)}), so its points are simulated anew"
            print(f"note: {path}: {why}", file=sys.stderr)
            return None
        if not np.array_equal(arrays["theta"], theta):
            return None
        terms = {name: arrays[f"term_{name}"] for name in TERMS}
        failure = [str(reason) or None for reason in arrays["failure"]]
        retained = arrays["weighed"].tolist()
        if NOT_FINITE in failure and retained != self._weighed:
            return None
        return weighed(self.evaluate.loss, unit, theta, terms, failure)
