"""The settings that results rest on: flat, as JSON has them, and all of them the stage's."""

import json

from ruamel.yaml import YAML

from sling2sim2real.settings.provenance import (
    Change,
    changes,
    evidence_settings_of,
    policy_settings_of,
    settings_of,
)
from tests.project import ROOT

BAND, METHOD = "band1", "posterior"


def test_settings_are_values_by_their_keys_and_survive_json(params) -> None:
    values = settings_of(params, BAND, METHOD)
    assert values["setup.fork_width"] == 0.275 and values["bands.band1.mass"] == 0.023
    assert values["methods.posterior.law"] == params.methods[METHOD].law
    for settings in (values, policy_settings_of(params, BAND)):
        assert changes(json.loads(json.dumps(settings)), settings) == []


def test_changes_name_what_came_went_and_is_another(params) -> None:
    differences = changes({"a": 1, "b": None, "c": 0}, {"b": 2.0, "c": 0, "d": 3})
    assert [*map(str, differences)] == [
        "a was 1, is not there",
        "b was null, is 2.0",
        "d was not there, is 3",
    ]
    assert differences[1] == Change("b", None, 2.0)


def test_launches_as_evidence_bring_their_settings(params) -> None:
    plain, more = settings_of(params, BAND, METHOD), evidence_settings_of(params)
    assert "setup.arm_stiffness" not in plain and not plain.keys() & more.keys()
    assert "setup.arm_stiffness" in more and "trials.actuation_error" in more


def test_dvc_trains_a_policy_again_when_what_it_notes_has_changed(params) -> None:
    listed = YAML(typ="safe").load(ROOT / "dvc.yaml")["stages"]["policy"]["do"]["params"]
    listed = [key.replace("${item.band}", BAND) for key in listed]
    noted = policy_settings_of(params, BAND)
    assert [key for key in noted if not any(f"{key}.".startswith(f"{p}.") for p in listed)] == []
