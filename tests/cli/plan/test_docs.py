"""What docs/recording.md says of a plan is what params.yaml gives."""

from pipeline.params import load
from tests.project import DEFAULTS, ROOT


def test_the_table_of_phases_has_the_defaults() -> None:
    """What the page says of times and ways is what params.yaml gives."""
    params = load(DEFAULTS)
    plan = params.plan
    page = (ROOT / "docs/recording.md").read_text(encoding="utf-8")
    assert f"| lead-in | {plan.lead_in:g} s |" in page
    assert f"| approach, grasp | {plan.approach:.2f} m, {plan.finger_time:g} s |" in page
    assert f"| pull | {-plan.draw[0]:.2f} m in 4 s |" in page
    ways, times = (
        ", ".join(f"{value:g}" for value in values)
        for values in ([dip.depth for dip in plan.dips], [dip.out_time for dip in plan.dips])
    )
    assert all(dip.out_time == dip.back_time for dip in plan.dips)
    assert [dip.at for dip in plan.dips] == [0.8, 1, 1]
    assert f"| let back, redraw | {ways} m in {times} s each |" in page
    assert f"| pause | {plan.pause:g} s |" in page
    assert f"| release, swing | {plan.finger_time + plan.wait:g} s |" in page
    assert f"| retreat | {plan.retreat:.2f} m |" in page
