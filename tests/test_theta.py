"""θ files: read as written, and every mistake in them is one line that names it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from pipeline.errors import UserError
from pipeline.sling.model import THETA
from pipeline.theta import load_theta, vector

SOFT = dict(zip(THETA, (6e5, 0.45, 5e-3, 0.5, 1.0), strict=True))


def refusal(file: Path, text: str) -> str:
    file.write_text(text)
    with pytest.raises(UserError) as error:
        load_theta(file, "red")
    assert "\n" not in str(error.value)
    return str(error.value)


def test_a_theta_file_comes_back(tmp_path: Path) -> None:
    file = tmp_path / "theta.json"
    file.write_text(json.dumps({"band": "red", "theta": SOFT}))
    assert vector(load_theta(file, "red")).tolist() == list(SOFT.values())


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("youngs_modulus", 0),
        ("youngs_modulus", 10**400),
        ("poissons_ratio", 0.5),
        ("poissons_ratio", -0.1),
        ("elasticity_damping", 10.0),
        ("dynamic_friction", 50),
        ("dynamic_friction", float("nan")),
        ("damping_scale", 1.01),
        ("damping_scale", True),
        ("damping_scale", "1"),
    ],
)
def test_values_out_of_range_are_named(tmp_path: Path, name: str, value: object) -> None:
    text = json.dumps({"band": "red", "theta": SOFT | {name: value}})
    message = refusal(tmp_path / "theta.json", text)
    assert f"theta.{name} must be a number between" in message and len(message) < 300


@pytest.mark.parametrize("text", ["[" * 200_000, "", "{", "1" * 5000])
def test_what_is_no_json_object(tmp_path: Path, text: str) -> None:
    assert "cannot be read as JSON" in refusal(tmp_path / "theta.json", text)
