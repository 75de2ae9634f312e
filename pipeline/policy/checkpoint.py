"""What a killed training left: the next run goes on from it, to the bytes of an undisturbed one."""

from __future__ import annotations

import io
from pathlib import Path

import torch

from pipeline.base.files import replacing


class Checkpoint:
    """One state of a training in a file that DVC does not know."""

    def __init__(self, path: Path, fingerprint: str) -> None:
        """Look at `path`.

        Args:
            fingerprint: Of everything that the training depends on; another's state is not used.
        """
        self.path, self.fingerprint = Path(path), fingerprint

    def load(self) -> dict | None:
        """The state that `save` kept; None where there is none, or a damaged or foreign one."""
        try:
            kept = torch.load(self.path, weights_only=True)
            return kept["state"] if kept["fingerprint"] == self.fingerprint else None
        except Exception:
            return None  # not there, or damaged: a zip file can be in many ways

    def save(self, state: dict) -> None:
        """Keep a state of tensors, numbers, texts, lists and dictionaries."""
        saved = io.BytesIO()  # PyTorch itself would not say that a disk is full
        torch.save({"fingerprint": self.fingerprint, "state": state}, saved)
        with replacing(self.path) as temporary:
            temporary.write_bytes(saved.getvalue())
