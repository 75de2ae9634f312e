"""Which pixels show the band: backends behind one seam.

A backend is made for one view, learns once from its frames, and then masks each frame.
"""

from __future__ import annotations

from pipeline.base.errors import UserError
from pipeline.recording.masks.folder import FolderMask
from pipeline.recording.masks.ridge import RidgeMask
from pipeline.recording.view import View


def masker(name: str, view: View, sam3: object | None = None) -> object:
    """The backend of params.cloud.mask, with `mask(frame)`: pixels of the band (H, W), bool.

    `sam3` is params.cloud.sam3.

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
