"""Files of a band edited by hand: read as ever, or one clear line names the file."""

from pathlib import Path

from pipeline.params import load
from sling2sim2real.identification.results.theta import load_samples, load_sling
from sling2sim2real.simulator.parameters import Parameters
from tests.edited import outcomes
from tests.project import DEFAULTS
from tests.report.conftest import posterior


def test_the_calibration_of_clamps(tmp_path: Path) -> None:
    params, path = load(DEFAULTS), tmp_path / "clamps.json"
    content = {"clamp_direction": [0.6, 0.0, -0.8], "flexural_rigidity": 2e-3}
    read, refused = outcomes(path, content, lambda: load_sling(params, "band1", path))
    assert refused > 20 and read == 1  # with a key that nobody knows


def test_samples(tmp_path: Path) -> None:
    path = tmp_path / "data" / "confidence" / "toy" / "method.json"
    best = Parameters.of("rubber", [2e5, 0.45, 2e-3, 0.5, 0.5])
    content = posterior() | {"samples": posterior()["samples"][:2]}
    read, refused = outcomes(path, content, lambda: load_samples(path, best))
    assert refused > 20 > read
