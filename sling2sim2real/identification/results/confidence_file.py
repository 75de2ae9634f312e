"""data/confidence/: what a search says of θ beside its evaluations, as every search writes it.

{"band": "...", "names": [...], "samples": [[...], ...], "estimate": {...}}: samples of the
posterior, none where the search has none; and under `estimate` the entries of the θ file that no
table of evaluations holds, such as its confidence.
"""

from __future__ import annotations

from pathlib import Path

from sling2sim2real.base.files import write_json
from sling2sim2real.base.schema import read_json
from sling2sim2real.identification.results.theta import PosteriorFile
from sling2sim2real.simulator.parameters import Parameters


class ConfidenceFile(PosteriorFile):
    band: str
    estimate: dict


def save_confidence(
    path: Path, band: str, entries: dict, samples: Parameters | None = None, *, mounting: bool
) -> None:
    """Write a `ConfidenceFile`; without `mounting` the clamps were left as `setup` says."""
    if not mounting:
        entries = entries | {"mounted": False}
    names, values = ([], []) if samples is None else ([*samples.names], samples.values.tolist())
    content = {"band": band, "names": names, "samples": values, "estimate": entries}
    write_json(path, content)


def load_confidence(path: Path) -> dict:
    """The entries of the θ file that such a file holds. Raises NotMade."""
    return read_json(path, ConfidenceFile).estimate
