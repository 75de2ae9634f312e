"""The calibration of docs/recording.md, run as it stands there."""

import numpy as np
from ruamel.yaml import YAML
from scipy.spatial.transform import Rotation

from app.plan.plan import plan_recording
from pipeline.params import load
from tests.project import DEFAULTS, ROOT, python, with_


def test_two_touched_tips_give_the_fork_in_the_base() -> None:
    """A fork that stands askew: its tips in the base go in, and where it stands comes out."""
    stands = Rotation.from_euler("z", -70, degrees=True), np.array([0.62, -0.11, 0.37])
    left, right = (stands[0].apply([side * 0.1375, 0, 0]) + stands[1] for side in (-1, 1))
    page = (ROOT / "docs/recording.md").read_text(encoding="utf-8")
    code = page.split("```python\n")[1].split("```")[0]
    given = code[code.index("left, right =") : code.index("up =")]
    touched = f"left, right = np.array({left.tolist()}), np.array({right.tolist()})\n"
    found = YAML(typ="safe").load(python("-c", code.replace(given, touched)).stdout)
    assert found["fork_width"] == 0.275
    np.testing.assert_allclose(found["base_to_fork"][:3], stands[1], atol=1e-5)
    turn = Rotation.from_quat(found["base_to_fork"][3:])
    assert (turn.inv() * stands[0]).magnitude() < 1e-4

    params = load(DEFAULTS)
    stood = with_(params, "setup", base_to_fork=tuple(found["base_to_fork"]))
    plan = plan_recording(stood, "band1")
    drawn = plan.base.apply(np.array([0.0, -0.4, 0.0]))
    np.testing.assert_allclose(drawn, stands[0].apply([0, -0.4, 0]) + stands[1], atol=1e-4)


def test_the_table_of_phases_has_the_defaults() -> None:
    """What the page says of times and ways is what params.yaml gives."""
    params = load(DEFAULTS)
    plan = params.plan
    page = (ROOT / "docs/recording.md").read_text(encoding="utf-8")
    assert f"| lead-in | {plan.lead_in:g} s |" in page
    assert f"| approach, grasp | {plan.approach:.2f} m, {plan.finger_time:g} s |" in page
    assert f"| pull | {-plan.draw[0]:.2f} m in 4 s |" in page
    assert f"| pause | {plan.pause:g} s |" in page
    assert f"| release, swing | {plan.finger_time + plan.wait:g} s |" in page
    assert f"| retreat | {plan.retreat:.2f} m |" in page
