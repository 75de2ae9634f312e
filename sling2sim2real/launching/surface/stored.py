"""A policy in its folder, and what it says."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from sling2sim2real.base.files import NotMade, made
from sling2sim2real.base.schema import LIST, JsonRecord, read_json


class Training(JsonRecord):
    """Errors are launched |y_p - g| [m] of the checked targets; None where none lands."""

    converged: bool
    mean_error_m: float | None
    max_error_m: float | None


class Projectile(JsonRecord):
    trained_at: Annotated[tuple[float, float], LIST]  # (y, z), m


class Card(JsonRecord):
    """The part of a policy's card (policy/export.py) that is read."""

    training: Training
    made_with: dict[str, Any] | None = None  # settings of params.yaml (settings/provenance.py)
    projectile: Projectile | None = None  # of a policy that sees it


@dataclass(frozen=True)
class Stored:
    """A policy.

    Attributes:
        folder: Where its files lie, or would.
        card_name: Of the file beside the network that says what it is (policy/export.py).
    """

    folder: Path
    card_name: str = "card.json"

    @classmethod
    def of_band(cls, folder: Path) -> Stored:
        """That in a band's folder (api/band_folder.py)."""
        return cls(folder, "policy.json")

    @property
    def network(self) -> Path:
        """policy.onnx, metres to metres."""
        return self.folder / "policy.onnx"

    @property
    def card_file(self) -> Path:
        return self.folder / self.card_name

    def card(self) -> dict:
        """What its card says (export.card). Raises NotMade: missing, or damaged."""
        return read_json(made(self.card_file), Card).model_dump()

    def draws(self, targets: np.ndarray) -> np.ndarray:
        """Draws (y, z) [m], shape (N, 2), for targets [m], (N,).

        Raises:
            NotMade: The policy is not there, or damaged.
        """
        import onnxruntime

        path = made(self.network)
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1
        options.log_severity_level = 4  # what is wrong is said below
        given = {"target": np.asarray(targets, np.float32)[:, None]}
        try:
            session = onnxruntime.InferenceSession(
                path.read_bytes(), options, providers=["CPUExecutionProvider"]
            )
            if "projectile" in {port.name for port in session.get_inputs()}:
                at = np.array(self._projectile(), np.float32)
                given["projectile"] = np.tile(at, (len(given["target"]), 1))
            return np.asarray(session.run(["draw"], given)[0], float)
        except NotMade:
            raise
        except Exception as error:  # onnxruntime has an error of its own for each kind of damage
            raise NotMade(path, "damaged") from error

    def _projectile(self) -> tuple[float, float]:
        """Where the projectile starts (y, z) [m], as the policy was trained with."""
        projectile = self.card()["projectile"]
        if projectile is None:
            raise NotMade(self.card_file, "lacks the policy's input `projectile`")
        return projectile["trained_at"]
