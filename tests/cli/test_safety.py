"""What a robot hears first: each warning, by what it is about."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.params import load
from sling2sim2real.base.layout import Layout
from sling2sim2real.cli import safety
from sling2sim2real.episode.episode import Episode
from sling2sim2real.settings.provenance import evidence_settings_of, policy_settings_of, settings_of
from sling2sim2real.simulator.parameters import THETA
from tests.project import DEFAULTS, with_

VALUES = dict(zip(THETA, (6e5, 0.45, 5e-3, 0.5, 1.0), strict=True))
CONTENT = {"band": "band1", "theta": VALUES, "confidence": {"settled": True, "steps": 7}}
STAGE = "policy@band1-posterior"


def abouts(hazards) -> list[str]:
    return [hazard.about for hazard in hazards]


@pytest.fixture
def project(tmp_path):
    """params.yaml, and a recording that draws band1 to y = -0.3."""
    (tmp_path / "params.yaml").write_text(DEFAULTS.read_text())
    time = np.arange(4.0)
    way = np.array([[0, 0, 0], [0, -0.1, 0], [0, -0.3, 0], [0, -0.9, 0]])
    nothing = np.zeros((4, 3))
    clouds = [np.zeros((1, 3))] * 4
    episode = Episode(
        "band1", time, way, nothing, nothing, time, time, clouds, 0.0, 2.0, np.zeros(3)
    )
    episode.save(Layout(tmp_path).episode("band1"))
    return tmp_path


def edit(root, old: str, new: str) -> None:
    path = root / "params.yaml"
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))


def card(root, **content) -> None:
    errors = {"draws": 1, "mean_error_m": 0.0, "max_error_m": 0.0}
    whole = {
        "theta": VALUES,
        "training": {"converged": True, "mean_error_m": 0.0, "max_error_m": 0.0},
        "landing_map": {"box": errors, "target_range": errors},
        "made_with": {},
        **content,
    }
    path = Layout(root).policy("band1", "posterior") / "card.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(whole))


def of_policy(params, root, content=CONTENT) -> list[safety.Hazard]:
    return list(safety.of_policy(params, "band1", "posterior", content, root))


def test_a_draw_outside_the_box(params, project) -> None:
    for draw, expected in (
        ((-0.26, -0.12), []),
        ((-0.25, -0.10), []),
        ((-0.20, -0.12), ["box"]),
        ((-0.20, -0.35), ["box", "box", "stretch"]),
    ):
        assert abouts(safety.of_draw(params, "band1", draw, project)) == expected


def test_a_draw_beyond_the_recorded_stretch_says_both_in_per_cent(params, project) -> None:
    """Two sides of a triangle: 0.1375 and 0.3 against 0.1375 and 0.4, rest length 0.52."""
    edit(project, "  - -0.30\n  - -0.10\n", "  - -0.30\n  - 0.0\n")
    (hazard,) = safety.of_draw(params, "band1", (-0.4, -0.1), project)
    requested = 2 * np.hypot(0.1375, np.hypot(0.4, 0.1)) / 0.52 - 1
    recorded = 2 * np.hypot(0.1375, 0.3) / 0.52 - 1
    assert (
        f"by {100 * requested:.1f} %, its recordings by {100 * recorded:.1f} % at most"
        in hazard.what
    )


def test_without_an_episode_the_recorded_stretch_is_unknown(params, tmp_path) -> None:
    (hazard,) = safety.of_draw(params, "band1", (-0.3, -0.2), tmp_path)
    assert hazard.about == "stretch" and "data/episodes/band1 is missing" in hazard.what


def test_more_force_than_the_arm_may_hold(params) -> None:
    limit = params.setup.max_force
    assert not list(safety.of_launch(params, limit, None))
    (hazard,) = safety.of_launch(params, limit + 1, None)
    assert hazard.about == "force" and "31.0 N, more than setup.max_force 30 N" in hazard.what
    assert abouts(safety.of_launch(params, np.nan, "it broke")) == ["failure"]


def test_a_posterior_that_has_not_settled_or_is_not_there(tmp_path) -> None:
    assert not list(safety.of_confidence(CONTENT, tmp_path))
    content = CONTENT | {"confidence": {"settled": False, "steps": 14}}
    (hazard,) = safety.of_confidence(content, tmp_path / "t.json")
    assert "t.json had not settled after 14 steps" in hazard.what
    few = CONTENT | {"confidence": {"settled": True, "effective_samples": 0.0}}
    (hazard,) = safety.of_confidence(few, tmp_path / "t.json")
    assert "rest on 0 samples" in hazard.what
    for content in (CONTENT | {"confidence": None}, {"theta": VALUES}):
        (hazard,) = safety.of_confidence(content, tmp_path)
        assert hazard.about == "confidence" and "does not tell how well" in hazard.what


def identified(params, **then) -> dict:
    """Content of a θ file that was made with other settings than today's: `then`, by key."""
    return CONTENT | {"made_with": settings_of(params, "band1", "posterior") | then}


def trained(params, **then) -> dict:
    """The same of what a policy was trained with."""
    return policy_settings_of(params, "band1") | then


def test_params_that_changed_since_training_by_key_values_and_cure(params, project) -> None:
    """Of the policy's own settings, and of those of the θ that it was trained with."""
    then = identified(params, **{"loss.median_window": 9})
    del then["made_with"]["loss.chamfer"]
    card(project, made_with=trained(params))
    summary = [hazard.what for hazard in of_policy(params, project, then)]
    cure = f"since the policy was trained: `dvc repro {STAGE}` mends it"
    assert summary[0] == f"params.yaml: loss.chamfer was not there, is symmetric, {cure}"
    assert summary[1] == f"params.yaml: loss.median_window was 9, is 7, {cure}"
    assert len(summary) == 2
    edit(project, "max_force: 30.0", "max_force: 25.0")
    last = of_policy(load(project / "params.yaml"), project, then)[-1]
    assert last.what == f"params.yaml: setup.max_force was 30.0, is 25.0, {cure}"


def test_a_theta_identified_anew_hides_no_change_of_the_policys(params, project) -> None:
    """θ was identified with today's mass, the policy trained before."""
    card(project, made_with=trained(params, **{"bands.band1.mass": 0.05}))
    (hazard,) = of_policy(params, project, identified(params))
    assert "bands.band1.mass was 0.05, is 0.023" in hazard.what


def test_many_changes_are_three_and_the_names_of_the_others(params, project) -> None:
    values = {f"setup.{name}": 1e-3 for name in ("max_force", "fork_width", "fork_height")}
    card(project, made_with=trained(params, **values, **{"policy.seed": 7, "sling.edges": 12}))
    summary = of_policy(params, project)
    assert abouts(summary) == ["params"] * 4 and "policy.seed was 7, is 1" in summary[0].what
    assert summary[3].what.endswith("also in setup.max_force, sling.edges")


def test_a_card_that_does_not_tell(params, project) -> None:
    card(project, made_with=None)
    (hazard,) = of_policy(params, project)
    assert (
        hazard.what
        == f"nothing tells what the policy was trained with: `dvc repro {STAGE}` mends it"
    )


def test_a_policy_of_another_theta(params, project) -> None:
    card(project)
    assert not of_policy(params, project)
    other = CONTENT | {"theta": VALUES | {"youngs_modulus": 5e5}}
    (hazard,) = of_policy(params, project, other)
    assert "another θ" in hazard.what and f"`dvc repro {STAGE}`" in hazard.what


def test_a_policy_without_a_card(params, project) -> None:
    (hazard,) = of_policy(params, project)
    assert hazard.about == "params" and "card.json: missing" in hazard.what


def test_theta_of_a_run_and_by_hand(params, project) -> None:
    content = identified(params, **{"bands.band1.mass": 0.05})
    path, cure = Layout(project).theta("band1", "posterior"), "theta@band1-posterior"
    summary = [hazard.what for hazard in safety.of_identification(params, content, path)]
    assert summary == [
        "params.yaml: bands.band1.mass was 0.05, is 0.023, since θ was identified:"
        f" `dvc repro {cure}` mends it"
    ]
    assert not list(safety.of_identification(params, content, project / "mine.json"))
    assert not list(safety.of_identification(params, identified(params), path))
    (hazard,) = safety.of_identification(params, CONTENT, path)
    assert hazard.what.startswith("nothing tells with which params.yaml θ was identified")


def test_launches_as_evidence_are_settings_too(params, project) -> None:
    seen = {"settled": True, "steps": 7, "launches": [{}]}
    then = settings_of(params, "band1", "posterior") | evidence_settings_of(params)
    content = CONTENT | {"confidence": seen, "made_with": then | {"setup.projectile_mass": 0.05}}
    path = Layout(project).theta("band1", "posterior")
    (hazard,) = safety.of_identification(params, content, path)
    assert "setup.projectile_mass was 0.05, is 0.039" in hazard.what


def test_a_method_that_runs_no_more_is_mended_by_naming_it(params, project) -> None:
    card(project, made_with=trained(params, **{"setup.max_force": 28.0}))
    ablations = SimpleNamespace(bands=[], methods=[])
    alone = with_(params, "run", bands=[], methods=[], ablations=ablations)
    (hazard,) = of_policy(alone, project)
    assert "`run:` in params.yaml has to name" in hazard.what
