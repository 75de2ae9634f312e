"""What the searching stages share: an evaluator that reports, and resumes after a kill.

Where it runs is said by the environment, because results do not depend on it beyond rounding:
SLING_DEVICE (cpu or cuda:0; default cpu) and SLING_WORKERS (threads on the CPU; default all cores).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

import numpy as np

from pipeline import episode as episode_module
from pipeline import signal as signal_module
from pipeline.episode import Episode
from pipeline.errors import UserError
from pipeline.identify.checkpoint import Recorded, fingerprint
from pipeline.identify.evaluate import Evaluation, Evaluator
from pipeline.identify.loss import EpisodeLoss
from pipeline.identify.progress import Progress
from pipeline.identify.space import Space
from pipeline.sling import model as sling_module
from pipeline.sling.model import load_sling, mounting_path
from pipeline.stage import expect_episode

SOURCES = (
    Path(__file__).parent,
    Path(sling_module.__file__).parent,
    Path(episode_module.__file__),
    Path(signal_module.__file__),
)


@contextmanager
def session(
    stage: str, band: str, method: str, params, batches: int
) -> Iterator[Callable[[np.ndarray], Evaluation]]:
    """Give the evaluator of a stage; its checkpoint is removed when the block ends well."""
    folder = Path("data/episodes", band)
    evaluate = evaluator(params, band, method)
    recorded = Recorded(
        evaluate,
        Path(".checkpoints", stage, f"{band}-{method}"),
        fingerprint(
            *SOURCES,
            *(folder / name for name in ("signals.parquet", "clouds.parquet")),
            mounting_path(band),
            *(
                section.model_dump_json()
                for section in (
                    params.bands[band],
                    params.setup,
                    params.sling,
                    params.force,
                    params.parameters,
                    params.loss,
                    params.methods[method],
                )
            ),
            *(f"{package} {version(package)}" for package in ("warp-lang", "numpy", "scipy")),
            device(),
        ),
    )
    name = f"{stage}-{band}-{method}"
    yield Progress(recorded, name, batches, Path("logs", f"{name}.log"))
    recorded.clear()


def evaluator(params, band: str, method: str) -> Evaluator:
    """The evaluator of a recorded band, on the device that the environment names."""
    for section, key in (("bands", band), ("methods", method)):
        if key not in getattr(params, section):
            raise UserError(f"params.yaml has no {section}.{key}")
    episode = load_episode(band)
    sling = load_sling(params, band)
    return Evaluator(
        episode,
        sling,
        EpisodeLoss.of(params, method, episode, sling, device=device()),
        Space.of(params.parameters),
        device=device(),
        workers=workers(),
    )


def load_episode(band: str) -> Episode:
    """The recorded episode of a band. Raises UserError where it is missing."""
    expect_episode(band)
    return Episode.load(Path("data/episodes", band))


def device() -> str:
    """SLING_DEVICE. Raises UserError."""
    name = os.environ.get("SLING_DEVICE") or "cpu"
    if name != "cpu" and not name.startswith("cuda"):
        raise UserError(f"SLING_DEVICE must be cpu or cuda:0 and the like, got {name!r}")
    return name


def workers() -> int | None:
    """SLING_WORKERS; None is all cores. Raises UserError."""
    text = os.environ.get("SLING_WORKERS")
    if not text:
        return None
    if not (text.isascii() and text.isdigit() and int(text) > 0):
        raise UserError(f"SLING_WORKERS must be a whole number above 0, got {text!r}")
    return int(text)
