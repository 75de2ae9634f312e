"""The recordings of tests/recording, looked at once."""

from collections.abc import Iterator

import pytest

from sling2sim2real.cli.preflight.check import GivenBand, Look, look_at
from sling2sim2real.recording.build import Processed, process
from sling2sim2real.recording.events import Part
from sling2sim2real.settings import Settings
from sling2sim2real.settings.lab import BandParams
from tests.recording.conftest import blind, masked, params, seen

__all__ = ["blind", "masked", "params", "seen"]
PROCESSED: dict[str, Processed] = {}


def processed_once(part: Part, band: BandParams, params: Settings, weighed: bool) -> Processed:
    """`process`, which for equal pulls of a file is worked out once in all these tests."""
    if params.cloud.mask == "folder":  # the masks may be others
        return process(part, band, params, weighed)
    settings = params.model_dump(exclude={"run", "bands"})
    key = repr((part.recording.path, part.recording.sha256, part.number, band, settings, weighed))
    if key not in PROCESSED:
        PROCESSED[key] = process(part, band, params, weighed)
    return PROCESSED[key]


@pytest.fixture(scope="module", autouse=True)
def each_pull_is_processed_once() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sling2sim2real.cli.preflight.check.process", processed_once)
        yield


def band_of(params: Settings, **sizes: float) -> GivenBand:
    """What is known of a band by a command line."""
    return GivenBand.of(sizes, params.setup)


@pytest.fixture(scope="session")
def looked(seen, params) -> Look:
    """A recording that can be used."""
    return look_at(seen[0], params, band_of(params))


@pytest.fixture(scope="session")
def refused(blind, params) -> Look:
    """A recording whose pictures show no band."""
    return look_at(blind[0], params, band_of(params))
