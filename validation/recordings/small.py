"""Small recordings of every family and in every container, and params as small.

Each holds the same pull. It becomes an episode in about a tenth of a second.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from mcap.writer import CompressionType

from pipeline.params import Params, load
from validation.projects import DEFAULTS
from validation.recordings.bag import Lens, Truth, messages_of, write_again, write_bag
from validation.recordings.foxglove_bag import translate

CONTAINERS = {
    "zstd": {"compression": CompressionType.ZSTD},
    "lz4": {"compression": CompressionType.LZ4},
    "plain": {"compression": CompressionType.NONE},
    "unchunked": {"use_chunking": False, "enable_data_crcs": True},
}
TRUTH = Truth(grasp=0.4, lifted=0.6, drawn=1.1, release=1.6003, end=2.2, radius=0.012)
LENS = Lens(size=(80, 60), focal=62.5, fps=8)


def write_small(path: Path, family: str, container: str) -> None:
    """Write one recording; see FAMILIES and CONTAINERS."""
    with TemporaryDirectory() as folder:
        bag, other = Path(folder) / "bag.mcap", Path(folder) / "other.mcap"
        write_bag(bag, TRUTH, rate=200, pose_rate=50, lens=LENS)
        FAMILIES[family](bag, other)
        write_again(messages_of(other), path, **{"chunk_size": 12_000, **CONTAINERS[container]})


def small_params() -> Params:
    """The project's, for a window, pictures and a band as small as the recordings'."""
    whole = load(DEFAULTS)
    episode = {"duration": 2.0, "samples": 50, "tail": 0.3}
    cloud = {"points": 50, "statistical_neighbors": 5, "radius": 0.05, "radius_neighbors": 2}
    band = whole.bands["band1"].model_copy(update={"diameter": 2 * TRUTH.radius})
    sections = {
        "episode": whole.episode.model_copy(update=episode),
        "cloud": whole.cloud.model_copy(update=cloud),
        "bands": {"band1": band},
    }
    return whole.model_copy(update=sections)


FAMILIES: dict[str, Callable[[Path, Path], object]] = {
    "ros2": shutil.copyfile,  # CDR, pictures as JPEG and PNG
    "protobuf": partial(translate, encoding="protobuf", raw=True),
    "json": partial(translate, encoding="json"),
}
