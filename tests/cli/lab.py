"""A lab with a recorded band whose truth is a formula, and coarse settings: a fit takes seconds."""

from pathlib import Path

import pytest

from sling2sim2real.api.band_folder import BandFolder, write_yaml
from sling2sim2real.cli.fit import fit
from validation.projects import ROUGH
from validation.recordings.bag import Truth, write_bag

NAME, MASS = "toy", 0.03
LAB = {
    "episode": {"duration": 3.6, "samples": 120, "tail": 0.5},
    "sling": ROUGH,
    "optimizer": {"population": 6, "generations": 1, "k_nn": 6},
    "policy": {"map_size": [9, 7]},
}


def furnish(root: Path) -> Path:
    """A recording, seen.mcap, and bands/lab.yaml."""
    write_bag(root / "seen.mcap", Truth())
    write_yaml(root / "bands/lab.yaml", LAB, "A lab")
    return root


def fitted(root: Path) -> Path:
    """The same with its band fitted."""
    furnish(root)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(root)
        fit(BandFolder.named(NAME), [Path("seen.mcap")], {"mass": MASS})
    return root
