"""Measured launches read from CSV: to fit or to check, and what is refused."""

from pathlib import Path

import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.launches_file import (
    LaunchRow,
    read_launches,
    write_launches,
)

HEAD = "draw_y,draw_z,error,landing,use"


def read(tmp_path: Path, text: str | bytes) -> list[LaunchRow]:
    file = tmp_path / "toy.csv"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_launches(file)


def test_launches_are_read_as_spreadsheets_write_them(tmp_path) -> None:
    """With spaces, a byte order mark and lines of commas."""
    text = (
        "\ufeffdraw_y, draw_z,error,landing,use,target,method\n"
        "-0.3,-0.17,,2.2,,,\n-0.31, -0.17 ,0.002,1.9,check,1.925,ours\n"
        "-0.3,-0.17,0,,check,1.9,\n,,,,,,\n\n"
    )
    assert read(tmp_path, text) == [
        LaunchRow((-0.3, -0.17), None, 2.2),
        LaunchRow((-0.31, -0.17), 0.002, 1.9, "check", 1.925, "ours"),
        LaunchRow((-0.3, -0.17), 0.0, None, "check"),  # nobody aimed it
    ]
    assert read(tmp_path, HEAD) == [] == read_launches(tmp_path / "none.csv")


def test_what_is_written_is_read(tmp_path) -> None:
    rows = [LaunchRow((-0.3, -0.1), None, 1.9), LaunchRow((-0.2, 0.1), 0.01, None, "check")]
    fast = LaunchRow((-0.3, -0.1), None, None, speed=5.1, angle=-2.0)
    aimed = LaunchRow((-0.3, -0.1), None, 1.9, "check", 1.925, "ours")
    for more, names in (([], ""), ([fast], "speed,angle"), ([fast, aimed], "target,method")):
        write_launches(tmp_path / "a.csv", [*rows, *more])
        assert read_launches(tmp_path / "a.csv") == [*rows, *more]
        assert (tmp_path / "a.csv").read_text().splitlines()[0].endswith(names or HEAD)
    assert not fast.equals(rows[0]) and fast.equals(fast)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("draw_y,draw_z\n-0.3,-0.1\n", "lacks the column landing"),
        (f"{HEAD},pace\n", "unknown column 'pace'"),
        (f"{HEAD},speed\n-0.3,-0.1,,,,-5\n", "line 2: speed must lie from 0 to 100 m/s"),
        (f"{HEAD},speed,angle\n-0.3,-0.1,,,,5,95\n", "line 2: angle must lie from -90 to 90 deg"),
        (f"{HEAD}\n-0.3,-0.1,,far,fit\n", "line 2: landing must lie from 0 to 20 m"),
        (f"{HEAD}\n-0.3,-0.1,,1,\n-0.3,,,1,\n", "line 3: a launch needs draw_y and draw_z"),
        (f"{HEAD}\n-0.3,-0.1,,,fit\n", "line 2: a launch that did not land, without a speed,"),
        (f"{HEAD}\n-0.3,-0.1,,1,score\n", "line 2: use must be fit or check, got 'score'"),
        (f"{HEAD}\n-0.3,-0.1,,1,fit,9\n", "line 2: more cells than the 5 columns"),
        (f"{HEAD},method\n-0.3,-0.1,,1,fit,ours\n", "line 2: a launch that a policy aimed is to"),
        (
            f"{HEAD},target,method\n-0.3,-0.1,,1,check,2.425,a\n-0.3,-0.1,,1,check,3.0,a\n",
            "line 3: target must lie from 1.425 to 2.425 m",
        ),
        ((f"{HEAD}\n-0.3,-0.1,,1,\n").encode("utf-16"), "not UTF-8"),
        (f"{HEAD}\n".encode() + b"1" * 200_000, "cannot be read as CSV"),
    ],
)
def test_refuses_what_no_launch_can_have_done(tmp_path, text: str | bytes, message: str) -> None:
    with pytest.raises(UserError, match=message) as refused:
        read(tmp_path, text)
    assert str(refused.value).startswith(str(tmp_path / "toy.csv"))
    assert "\n" not in str(refused.value)
