"""Where the policies of a band and a method lie, and what they say."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.base.layout import Layout, NotMade
from pipeline.base.schema import JsonRecord, read_json

PLAIN, ROBUST = "plain", "robust"  # ROBUST is also the folder of a method's second policy


class Training(JsonRecord):
    """Errors are launched |y_p - g| [m] of the checked targets; None where none lands."""

    converged: bool
    mean_error_m: float | None
    max_error_m: float | None


class MapError(JsonRecord):
    """Of reading between simulated launches, on so many random draws [m]; None where none lands."""

    draws: int
    mean_error_m: float | None
    max_error_m: float | None


class LandingMapErrors(JsonRecord):
    box: MapError
    target_range: MapError


class Card(JsonRecord):
    """As much of a policy's card (policy/export.py) as is read."""

    training: Training
    landing_map: LandingMapErrors


@dataclass(frozen=True)
class Stored:
    """The policies of `method` for `band`: a plain one, and beside it a robust one or none.

    Attributes:
        root: Of the project.
    """

    band: str
    method: str
    root: Path = Path()

    def folder(self, kind: str = PLAIN) -> Path:
        """Where a policy's files lie, or would."""
        plain = Layout(self.root).policy(self.band, self.method)
        return plain / ROBUST if kind == ROBUST else plain

    def kinds(self) -> list[str]:
        """PLAIN, and ROBUST where there is such a policy; its card is what is written last."""
        return [PLAIN, ROBUST] if (self.folder(ROBUST) / "card.json").is_file() else [PLAIN]

    def card(self, kind: str = PLAIN) -> dict:
        """What a policy's card says (export.card). Raises NotMade: missing, or damaged."""
        return read_json(self._file(kind, "card.json"), Card).model_dump()

    def draws(self, targets: np.ndarray, kind: str = PLAIN) -> np.ndarray:
        """Draws (y, z) [m], shape (N, 2), for targets [m], (N,).

        Raises:
            NotMade: The policy is not there, or damaged.
        """
        import onnxruntime

        path = self._file(kind, "policy.onnx")
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        options.log_severity_level = 4  # what is wrong is said below
        targets = np.asarray(targets, np.float32)[:, None]
        try:
            session = onnxruntime.InferenceSession(
                path.read_bytes(), options, providers=["CPUExecutionProvider"]
            )
            return session.run(["draw"], {"target": targets})[0].astype(float)
        except Exception as error:  # onnxruntime has an error of its own for each kind of damage
            raise NotMade(path, "damaged") from error

    def _file(self, kind: str, name: str) -> Path:
        path = self.folder(kind) / name
        if path.is_file():
            return path
        trains = (
            f"where policy.robust.methods in params.yaml names {self.method} and its θ file tells"
            " its confidence"
        )
        raise NotMade(path, condition=trains if kind == ROBUST else "")
