"""Write a band for another engine, matched to the calibrated simulation."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from sling2sim2real.api.model import Model
from sling2sim2real.exporting.export import write


@dataclass(frozen=True)
class Exported:
    """What was written.

    Attributes:
        folder: With the files.
        met: Whether the replay in the target's engine came as near as is asked; None where nothing
            was simulated there.
        card: What card.json holds: values, matched parameters, what the match leaves.
    """

    folder: Path
    met: bool | None
    card: dict


def export(
    model: Model,
    to: str,
    out: str | Path,
    *,
    samples: int = 0,
) -> Exported:
    """Write a band for another engine into a folder, with a card that says what came out.

    Its parameters are matched to this simulation: the same force to hold a draw, the same landings.
    docs/export.md says for whom, and what stands in for what an engine cannot express.

    >>> import tempfile
    >>> from sling2sim2real import Band, Model, Settings, Theta, export
    >>> band = Band(mass=0.023, diameter=0.010, rest_length=0.52)
    >>> model = Model(band, Theta(2.0e5, 0.47, 2.4e-3, 0.7, 0.6), settings=Settings.coarse())
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     done = export(model, "usd", folder)
    ...     sorted(file.name for file in done.folder.iterdir())
    ['README.md', 'band.usda', 'card.json', 'nodes.json']

    Args:
        model: From `identify`, or written by hand.
        to: `mjcf` for MuJoCo; `newton` for Newton, which must be installed (extra `export`); `usd`
            for PhysX, to be matched there.
        out: Folder; what an export wrote there before is replaced.
        samples: Of the posterior, as parameters of the engine in samples.parquet; not for `usd`.

    Raises:
        UserError: No such target, what it needs is missing, the folder holds something else, the
            band cannot be matched, or has fewer samples.
    """
    card = write(model, to, Path(out), samples)  # pyright: ignore[reportArgumentType]
    return Exported(Path(out), card.get("met"), card)
