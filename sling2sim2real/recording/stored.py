"""Episodes that a check of a recording makes anyway, kept for the stage that makes them next.

They lie in .checkpoints/ under a key of all that they depend on: whoever asks with anything changed
finds none, and makes them.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import replacing_folder
from sling2sim2real.base.fingerprint import fingerprint
from sling2sim2real.base.layout import Layout, NotMade
from sling2sim2real.episode.episode import Episode
from sling2sim2real.recording.input.bag import sha256
from sling2sim2real.settings import Settings

PIPELINE = Path(__file__).parents[1]
SOURCES = [PIPELINE / name for name in ("base", "episode", "recording")]
PACKAGES = "numpy", "scipy", "open3d", "opencv-python-headless", "pillow", "rosbags"


def keep(path: Path, episodes: Sequence[Episode], params: Settings, layout: Layout) -> None:
    """Keep what `build_episodes` would make of a recording."""
    if _keeps(path, params):
        with replacing_folder(_folder(path, episodes[0].band, params, layout)) as folder:
            for number, episode in enumerate(episodes, 1):
                episode.save(folder / str(number))


def load_or_build(
    path: Path, band: str, params: Settings, layout: Layout
) -> tuple[list[Episode], list[UserError]]:
    """Return what `build_episodes` would, from what is stored where it still holds."""
    if _keeps(path, params):
        try:
            return Episode.load_all(_folder(path, band, params, layout)), []
        except NotMade:
            pass
    from sling2sim2real.recording.build import build_episodes  # which takes a second to import

    return build_episodes(path, band, params)


def forget(band: str, layout: Layout) -> None:
    """Throw away what is kept of a band's recordings."""
    shutil.rmtree(_of_band(band, layout), ignore_errors=True)


def _keeps(path: Path, params: Settings) -> bool:
    """Masks in files or of a model, and the parts of a bag, are no part of the key."""
    return params.cloud.mask == "opencv" and path.is_file()


def _of_band(band: str, layout: Layout) -> Path:
    return layout.root / ".checkpoints" / f"{band}-episodes"


def _folder(path: Path, band: str, params: Settings, layout: Layout) -> Path:
    sections = params.bands[band], params.setup, params.episode, params.cloud, params.force
    key = fingerprint(
        path.name,
        sha256(path),
        *SOURCES,
        *(section.model_dump_json() for section in sections),
        *([Path(params.setup.urdf)] if params.setup.urdf else []),
        *(f"{package} {version(package)}" for package in PACKAGES),
    )
    return _of_band(band, layout) / key[:16]
