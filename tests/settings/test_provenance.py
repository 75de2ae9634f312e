"""The settings that a policy rests on: as JSON has them, and all of them its stage's."""

import json

from ruamel.yaml import YAML

from sling2sim2real.settings.provenance import policy_settings_of
from tests.project import ROOT

BAND = "band1"


def test_settings_are_values_by_their_keys_and_survive_json(params) -> None:
    values = policy_settings_of(params, BAND)
    assert values["setup"]["fork_width"] == 0.275 and values["bands"][BAND]["mass"] == 0.023
    assert json.loads(json.dumps(values)) == values


def test_dvc_trains_a_policy_again_when_what_it_notes_has_changed(params) -> None:
    listed = YAML(typ="safe").load(ROOT / "dvc.yaml")["stages"]["policy"]["do"]["params"]
    listed = [key.replace("${item.band}", BAND) for key in listed]
    noted = policy_settings_of(params, BAND)
    keys = [f"{section}.{name}." for section, entries in noted.items() for name in entries]
    assert [key for key in keys if not any(key.startswith(f"{p}.") for p in listed)] == []
