"""A recording of the rig is sound."""

from pipeline.recording.build import process


def test_no_check_fires_on_the_rig(recorded, coarse) -> None:
    """Its small pictures apart, which show less of the band."""
    found = process(recorded[0], coarse.bands["band1"], coarse).findings
    assert {one.about for one in found} <= {"coverage", "extrinsics"}, [*map(str, found)]
