"""The rubber that lands far off: what is changed of it, and what the page has of the results."""

import json

from tests.project import ROOT
from validation.campaigns.outlier import CHANGES, REPORT, USUAL, Changed, farthest
from validation.rubbers import SEALED, rubbers


def test_one_part_of_the_rubber_is_changed() -> None:
    band = farthest()
    plain = Changed(band, "as it is").params.rig.bands[band]
    assert plain.flow is not None and plain.viscosity == rubbers(SEALED)[band][1]["viscosity"]
    others = {name: Changed(band, name).params.rig.bands[band] for name in CHANGES}
    assert others["without its flow"] == plain.model_copy(update={"flow": None})
    assert others["with more viscosity"] == plain.model_copy(update={"viscosity": USUAL})


def test_the_page_says_what_each_change_does() -> None:
    content = json.loads((ROOT / REPORT).read_text(encoding="utf-8"))
    assert content["band"] == farthest() and content["figures"].keys() == CHANGES.keys()
    bias = {name: 100 * row["mean_bias"] for name, row in content["figures"].items()}
    page = " ".join((ROOT / "docs/identification.md").read_text(encoding="utf-8").split())
    flowless, viscous = bias["without its flow"], bias["with more viscosity"]
    assert f"{flowless:.1f} % without its flow, {viscous:.1f} % with more viscosity" in page
    assert f"instead of {bias['as it is']:.1f} %" in page
