"""What a killed training left: the next run goes on from it, to the bytes of an undisturbed one."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import torch

from pipeline.base.errors import one_line
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
        if not self.path.is_file():
            return None
        try:
            content = torch.load(self.path, weights_only=True)
            state, fingerprint = content["state"], content["fingerprint"]
        except Exception as error:  # a zip file can be damaged in many ways
            why = f"damaged ({one_line(error)}), so the training begins anew"
            print(f"note: {self.path}: {why}", file=sys.stderr)
            return None
        return state if fingerprint == self.fingerprint else None

    def save(self, state: dict) -> None:
        """Keep a state of tensors, numbers, texts, lists and dictionaries."""
        saved = io.BytesIO()  # PyTorch itself would not say that a disk is full
        torch.save({"fingerprint": self.fingerprint, "state": state}, saved)
        with replacing(self.path) as temporary:
            temporary.write_bytes(saved.getvalue())
