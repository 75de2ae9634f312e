"""What the searching stages share: an evaluator that reports, and remembers what it simulated."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path

from pipeline.episode import Episode
from pipeline.errors import UserError
from pipeline.fingerprint import fingerprint
from pipeline.identify.evaluate import Evaluator
from pipeline.identify.loss import EpisodeLoss
from pipeline.identify.memo import Memo
from pipeline.identify.progress import Progress
from pipeline.identify.space import Space
from pipeline.machine import device, workers
from pipeline.sling.model import load_sling, mounting_path
from pipeline.stage import expect_episode

PIPELINE = Path(__file__).parents[1]
LOSS = ("chamfer.h", "chamfer.py", "evaluate.py", "kernel.py", "loss.py", "nuisance.py")
SOURCES = (  # the code that a term of the loss hangs on
    *(PIPELINE / "identify" / name for name in (*LOSS, "phases.py", "space.py")),
    *(PIPELINE / name for name in ("episode.py", "native.py", "signal.py", "sling")),
)


def service(stage: str, band: str, method: str, params, rollouts: int) -> Progress:
    """The evaluator of a stage that has so many rollouts ahead; it says how it gets on."""
    evaluate = evaluator(params, band, method)
    sections = (params.bands[band], params.setup, params.sling, params.force, params.loss)
    memo = Memo(
        evaluate,
        Path(".checkpoints", band),
        fingerprint(
            *SOURCES,
            *(Path("data/episodes", band, f"{name}.parquet") for name in ("signals", "clouds")),
            mounting_path(band),
            *(section.model_dump_json() for section in sections),
            *(f"{package} {version(package)}" for package in ("warp-lang", "numpy", "scipy")),
            device(),
        ),
    )
    name = f"{stage}-{band}-{method}"
    return Progress(memo, name, rollouts, Path("logs", f"{name}.log"))


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
        Space.of_method(params, method),
        device=device(),
        workers=workers(),
    )


def load_episode(band: str) -> Episode:
    """The recorded episode of a band. Raises UserError where it is missing."""
    expect_episode(band)
    return Episode.load(Path("data/episodes", band))
