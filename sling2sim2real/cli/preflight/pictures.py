"""The pictures that `cloud.mask: folder` wants masks of, for the tool that makes them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import cv2

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import replacing_folder
from sling2sim2real.cli.preflight.output import expect_folder
from sling2sim2real.recording.build import Processed
from sling2sim2real.recording.mask_folder import mask_name


def expect_new(folder: Path) -> None:
    """Raises UserError where `folder` cannot be made, or is there."""
    expect_folder(folder)
    if os.path.lexists(folder):
        raise UserError(f"{folder}: is there already, name a folder that is not")


def write_pictures(pulls: Sequence[Processed], folder: Path) -> str:
    """Write the colour pictures of each pull's window as PNG, named as their masks are to be.

    Args:
        pulls: Of one recording.
        folder: A new one.

    Returns:
        What was written, in words.

    Raises:
        UserError: where `folder` cannot be made or is there.
    """
    expect_new(folder)
    views = [pull.view for pull in pulls if pull.view]  # the report says why others have none
    if not views:
        return f"{folder} was not written: no pull is understood"
    with replacing_folder(folder) as temporary:
        for view in views:
            for number in range(len(view)):
                if (picture := view.color(number)) is not None:
                    _, packed = cv2.imencode(".png", picture)
                    (temporary / mask_name(view.stamp(number))).write_bytes(packed.tobytes())
        count = sum(1 for _ in temporary.iterdir())
    return f"{folder}: {count} pictures to mask"
