"""Sling clouds against known truth, in many looks of band and background: report of every phase."""

import pytest

from pipeline.params import Params
from sling2sim2real.recording.clouds import clouds_of
from validation.recordings import looks

pytestmark = pytest.mark.validation

FRAMES = 60
MOST_OFF, LEAST_COVERED, MOST_STRAYS = 0.003, 0.9, 0.01  # m, shares


def test_the_band_is_found_in_every_look(params: Params, progress, record) -> None:
    summaries = {}
    for name, look in looks.LOOKS.items():
        view, truths = looks.view_of(look, looks.times(FRAMES))
        summaries[name] = looks.figures(view, truths, clouds_of(view, params.cloud))
        summary = summaries[name]["all"]
        progress(
            f"  {name}: {1e3 * summary['median_off_m']:.1f} mm,"
            f" {100 * summary['covered']:.1f} % covered,"
            f" {100 * summary['further_than_1cm']:.2f} % further than 1 cm"
        )
    whole = [phases["all"] for phases in summaries.values()]
    met = all(
        summary["median_off_m"] <= MOST_OFF
        and summary["covered"] >= LEAST_COVERED
        and summary["further_than_1cm"] <= MOST_STRAYS
        for summary in whole
    )
    record(
        "looks",
        requested="In every look of band and background (ray-traced, with shadows, noise of time of"
        " flight, flying pixels, JPEG, extrinsics off by 1 mm and 0.09 degrees), over all frames:"
        f" the cloud's median distance to the band's surface is at most {1e3 * MOST_OFF:g} mm,"
        f" {100 * LEAST_COVERED:g} % of its visible length has points within 5 mm, at most"
        f" {100 * MOST_STRAYS:g} % of the points lie further than 1 cm from it.",
        met=met,
        settings={"frames": FRAMES, "pictures": looks.SIZE, "cloud": params.cloud.model_dump()},
        figures=summaries,
    )
    assert met
