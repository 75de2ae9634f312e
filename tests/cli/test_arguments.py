"""Types of the command line: what they take, and the unit that a wrong number looks like."""

import argparse
import json

import pytest

from sling2sim2real.cli.arguments import address, diameter, draw, mass, rest_length, shown, target


def refusal(kind, text: str) -> str:
    with pytest.raises(argparse.ArgumentTypeError) as refused:
        kind(text)
    return str(refused.value)


@pytest.mark.parametrize(
    ("kind", "text", "likely"),
    [
        (mass, "40.8", "grams (0.0408)"),
        (rest_length, "52", "centimetres (0.52)"),
        (rest_length, "520", "millimetres (0.52)"),
        (diameter, "10", "millimetres (0.01)"),
        (diameter, "1", "centimetres (0.01)"),
        (target, "192.5", "centimetres (1.925)"),
        (target, "1925", "millimetres (1.925)"),
        (draw, "-30,-17", "centimetres (0.345)"),
    ],
)
def test_a_wrong_unit_is_named(kind, text: str, likely: str) -> None:
    assert refusal(kind, text).endswith(f"which looks like {likely}")


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "a", "", "1e9", "40.8g"])
def test_what_is_no_quantity_of_any_unit(text: str) -> None:
    for kind in (mass, rest_length, diameter, target):
        assert "looks like" not in refusal(kind, text)


def test_draw_is_two_numbers_behind_the_fork() -> None:
    for text, words in (
        ("-0.3", "must be Y,Z"),
        ("-0.3,a", "must be a number"),
        ("-0.3,-0.1,0", "must be Y,Z"),
        ("0.3,-0.1", "y must be below 0"),
        ("-0.01,0", "from 0.05 to 2, got 0.01"),
    ):
        assert words in refusal(draw, text)


def test_addresses() -> None:
    for right in ("tcp://10.0.0.5:8786", "head:8786", "tls://[::1]:8786"):
        assert address(right) == right
    assert "must be such as tcp://" in refusal(address, "foo")


def test_results_are_json_or_lines() -> None:
    content = {"landing_y_m": None, "interval_90_m": [1.0, 1.25], "failure": "broke"}
    assert json.loads(shown(content, True)) == content
    assert shown(content, False).splitlines() == [
        "landing_y_m    -",
        "interval_90_m  1 1.25",
        "failure        broke",
    ]
    with pytest.raises(ValueError, match="JSON"):
        shown({"x": float("nan")}, True)
