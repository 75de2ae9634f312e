"""Which pixels show the band: backends behind one seam.

A backend is made for one view, learns once from its frames, and then masks each frame.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from sling2sim2real.recording.masks.folder import FolderMask
from sling2sim2real.recording.masks.ridge import RidgeMask
from sling2sim2real.recording.view import RgbdFrame, View


class Mask(Protocol):
    """A backend that has learned from a view."""

    def mask(self, frame: RgbdFrame) -> np.ndarray:
        """Pixels of the band, shape (H, W), bool."""
        ...


def masker(name: str, view: View) -> Mask:
    """The backend of params.cloud.mask. Raises UserError where its masks are missing."""
    return BACKENDS[name](view)


BACKENDS = {"opencv": RidgeMask, "folder": FolderMask}
