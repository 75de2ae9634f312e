"""What each recording of the rig has of its own: `rig.draws` of params.yaml, by its seed.

The identification sees a recording. What stands in `rig` is no number that it may know, so a
recording draws its pads, clocks and camera errors anew, and no assumption can be tuned to them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

import numpy as np

if TYPE_CHECKING:
    from pipeline.params import Params

STREAM = 7  # of the seed, apart from those of noise


def sampled(params: Params, name: str, *, launching: bool = False) -> Params:
    """`params` with the numbers of a recording, or of a band's launches, each within its range.

    Args:
        name: By which they are drawn: the band's, of a recording with its stream behind.
    """
    rig, values = params.rig, {}
    for key, (low, high) in (rig.launch_draws if launching else rig.draws).items():
        rng = np.random.default_rng([rig.seed, STREAM, *name.encode(), *key.encode()])
        values[f"rig.{key}"] = float(f"{rng.uniform(low, high):.4g}")
    return cast("Params", _Overlaid(params, values))


class _Overlaid:
    """A section with some other values; it reads of what is below no more than is asked for."""

    def __init__(self, section: object, values: dict[str, float], path: str = "") -> None:
        self._section, self._values, self._path = section, values, path

    def __getattr__(self, name: str) -> Any:
        below, path = getattr(self._section, name), f"{self._path}{name}"
        if path in self._values:
            return self._values[path]
        if any(key.startswith(f"{path}.") for key in self._values):
            return _Overlaid(below, self._values, f"{path}.")
        return below
