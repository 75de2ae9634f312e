"""A recording of the rig is sound."""

import pytest

from sling2sim2real.recording.build import process_recording


@pytest.mark.slow
def test_no_check_fires_on_the_rig(recorded, coarse) -> None:
    """Its small pictures apart, which show less of the band."""
    done = process_recording(recorded[0], coarse.bands["band1"], coarse)[0][0]
    assert {finding.about for finding in done.findings} <= {"coverage", "extrinsics"}, [
        *map(str, done.findings)
    ]
