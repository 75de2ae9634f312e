"""A recording of the rig is sound."""

import pytest

from sling2sim2real.recording.build import process


@pytest.mark.slow
def test_no_check_fires_on_the_rig(recorded, coarse) -> None:
    """Its small pictures apart, which show less of the band."""
    findings = process(recorded[0], coarse.bands["band1"], coarse).findings
    assert {finding.about for finding in findings} <= {"coverage", "extrinsics"}, [
        *map(str, findings)
    ]
