"""What each recording of the rig has of its own: `rig.draws` of params.yaml, by its seed.

The identification sees a recording. What stands in `rig` is no number that it may know, so a
recording draws its pads, clocks and camera errors anew, and no assumption can be tuned to them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import numpy as np

if TYPE_CHECKING:
    from pipeline.base.schema import Section
    from pipeline.params import Params

Part = TypeVar("Part", bound="Section")
STREAM = 7  # of the seed, apart from those of noise
OF_LAUNCHES = ("projectile_drag",)


def drawn(params: Params, band: str, *, launching: bool = False) -> Params:
    """`params` with the numbers of a band's recording, or its launches, each within its range."""
    rig = params.rig
    for key, (low, high) in rig.draws.items():
        if (key in OF_LAUNCHES) == launching:
            rng = np.random.default_rng([rig.seed, STREAM, *band.encode(), *key.encode()])
            rig = _with(rig, key.split("."), float(f"{rng.uniform(low, high):.4g}"))
    return params.model_copy(update={"rig": rig})


def _with(section: Part, path: list[str], value: float) -> Part:
    name, *rest = path
    inner = _with(getattr(section, name), rest, value) if rest else value
    return section.model_copy(update={name: inner})
