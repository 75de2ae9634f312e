"""What docs/recording.md says of a plan is what params.yaml gives."""

from pipeline.params import load
from tests.project import DEFAULTS, ROOT


def test_the_text_has_the_defaults() -> None:
    """What the page says of times and ways is what params.yaml gives."""
    params = load(DEFAULTS)
    plan = params.plan
    page = " ".join((ROOT / "docs/recording.md").read_text(encoding="utf-8").split())
    assert f"The empty hand rests for {plan.lead_in:g} s" in page
    assert f"({-plan.draw[0]:.2f} m in 4 s)" in page
    assert len(plan.dips) == 3 and "three dips (`plan.dips`)" in page
    assert f"It pauses ({plan.pause:g} s: rubber relaxes)" in page
    assert f"{plan.finger_time + plan.wait:g} s of swing, and retreats" in page
