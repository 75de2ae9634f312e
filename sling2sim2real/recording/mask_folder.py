"""Masks that another tool made of a recording's pictures: a folder beside the recording."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording import images
from sling2sim2real.recording.scene import RgbdFrame, View

MASK_NAME = re.compile(r"[0-9]+\.png")


def masks_beside(recording: Path) -> Path:
    """Where the masks of a recording lie: my.masks beside my.mcap, or beside a bag's folder my/."""
    if recording.is_dir():
        return recording.with_name(f"{recording.name}.masks")
    return recording.with_suffix(".masks")


def mask_name(stamp: int) -> str:
    """The file of the picture with this header stamp [ns]."""
    return f"{stamp}.png"


class FolderMask:
    """What the folder's masks mark, where the band can be.

    Each is a grey PNG of its colour picture's size, named by that picture's stamp; what is not
    black is the band.
    """

    def __init__(self, view: View):
        """Raises UserError where the folder or a mask is missing."""
        self.view, camera = view, view.recording.color_camera
        self.folder, self.size = masks_beside(view.recording.path), (camera.height, camera.width)
        if not self.folder.is_dir():
            raise UserError(
                f"{self.folder}: there is no such folder of masks: `sling check --pictures` writes"
                " the pictures to mask; or set cloud.mask to opencv"
            )
        files = {self._file(k): k for k in range(len(view))}
        missing = [file for file, k in files.items() if not file.is_file()]
        missing = [file for file in missing if view.color(files[file]) is not None]  # not damaged
        if missing:
            raise UserError(
                f"{self.folder}: masks of {len(missing)} of {len(files)} pictures are missing,"
                f" {missing[0].name} first; give a black one where no band is seen"
            )

    def mask(self, frame: RgbdFrame) -> np.ndarray:
        file = self._file(frame.number)
        try:
            data = np.fromfile(file, np.uint8)
            picture = images.unpacked(data, "a mask")
        except OSError as error:
            raise UserError(f"{file}: cannot be read ({error.strerror})") from None
        except images.Undecodable as error:
            raise UserError(f"{file}: {error}") from None
        packed = data.tobytes().startswith(images.PNG)
        if not packed or picture.dtype != np.uint8 or picture.shape != self.size:
            height, width = self.size
            raise UserError(f"{file}: is no grey PNG of 8 bits or 1, {width} x {height} pixels")
        return self.view.marked(picture > 0, frame)

    def _file(self, number: int) -> Path:
        return self.folder / mask_name(self.view.stamp(number))
