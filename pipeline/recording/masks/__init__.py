"""Which pixels show the band: backends behind one seam.

A backend is made for one view, learns once from its frames, and then masks each frame.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from pipeline.base.errors import UserError
from pipeline.params.recording import Sam3
from pipeline.recording.masks.folder import FolderMask
from pipeline.recording.masks.ridge import RidgeMask
from pipeline.recording.view import RgbdFrame, View


class Mask(Protocol):
    """A backend that has learned from a view."""

    def mask(self, frame: RgbdFrame) -> np.ndarray:
        """Pixels of the band, shape (H, W), bool."""
        ...


def masker(name: str, view: View, sam3: Sam3 | None = None) -> Mask:
    """The backend of params.cloud.mask.

    Raises:
        UserError: There is no such backend, or it lacks something.
    """
    if name == "opencv":
        return RidgeMask(view)
    if name == "folder":
        return FolderMask(view)
    if name == "sam3" and sam3 is not None:
        from pipeline.recording.masks.sam3 import Sam3Mask

        return Sam3Mask(view, sam3)
    raise UserError(f"cloud.mask: backend {name!r} is not available, use opencv")
