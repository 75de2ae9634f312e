"""The project's params.yaml as an object, with other values, and wherever one works."""

from sling2sim2real import Settings
from tests.project import DEFAULTS


def test_changes_reach_any_depth_and_nothing_else() -> None:
    old = Settings.default()
    new = old.changed(policy={"reward": {"height": 4.0}}, setup={"draw_y": [-0.4, -0.2]})
    assert (new.policy.reward.height, new.setup.draw_y) == (4.0, (-0.4, -0.2))
    back = new.changed(
        policy={"reward": {"height": old.policy.reward.height}},
        setup={"draw_y": old.setup.draw_y},
    )
    assert back == old


def test_a_file_of_ones_own(tmp_path) -> None:
    text = DEFAULTS.read_text().replace("fork_width: 0.275", "fork_width: 0.25")
    (tmp_path / "mine.yaml").write_text(text)
    mine = Settings.load(tmp_path / "mine.yaml")
    assert mine.setup == Settings.default(setup={"fork_width": 0.25}).setup
    assert mine.bands["band1"].source == "rig"
