"""Measured launches read from CSV: whose they are, and what is refused."""

from pathlib import Path

import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.launch_table import DRAW, LANDING, MORE, file_of
from sling2sim2real.launching.trials.measured import (
    Measured,
    load_scores,
    read_measured,
    save_scores,
)

KNOWN = ("ours", "theirs")
HEAD = "draw_y_m,draw_z_m,landing_y_m"


def read(tmp_path: Path, text: str | bytes, method: str = "ours") -> list[Measured]:
    file = tmp_path / "toy.csv"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    launches = read_measured(file, KNOWN)
    save_scores(tmp_path / "scores.json", launches)
    assert load_scores(tmp_path / "scores.json") == launches
    return [launch for launch in launches if launch.method in ("", method)]


def test_launches_of_a_method_and_plain_ones(tmp_path) -> None:
    """Spaces, a byte order mark and lines of commas are what spreadsheets write."""
    text = (
        "\ufeffdraw_y_m, draw_z_m,landing_y_m,target_m,method\n"
        "-0.3,-0.17,2.2,,\n-0.31, -0.17 ,1.9,1.925,ours\n-0.3,-0.17,1.8,1.925,theirs\n"
        "-0.35,-0.17,,1.925,ours\n,,,,\n\n"
    )
    assert read(tmp_path, text) == [
        Measured(draw=(-0.3, -0.17), landing=2.2, target=None),
        Measured(draw=(-0.31, -0.17), landing=1.9, target=1.925, method="ours"),
        Measured(draw=(-0.35, -0.17), landing=None, target=1.925, method="ours"),
    ]
    assert [launch.landing for launch in read(tmp_path, text, "theirs")] == [2.2, 1.8]


def test_a_target_without_a_method_is_nobodys(tmp_path) -> None:
    """It would else count as an error of every method alike."""
    text = f"{HEAD},target_m,method\n-0.3,-0.1,1.9,1.725,\n-0.3,-0.1,1.9,1.725,ours\n"
    assert [launch.target for launch in read(tmp_path, text)] == [None, 1.725]
    assert [launch.target for launch in read(tmp_path, text, "theirs")] == [None]
    for target in (1.725, 3.0):
        without = f"{HEAD},target_m\n-0.3,-0.1,1.9,{target}\n"
        assert [launch.target for launch in read(tmp_path, without)] == [None]


def test_a_method_may_launch_without_a_target(tmp_path) -> None:
    text = f"{HEAD},method\n-0.3,-0.1,1.9,ours\n"
    assert read(tmp_path, text) == [
        Measured(draw=(-0.3, -0.1), landing=1.9, target=None, method="ours")
    ]
    assert read(tmp_path, text, "theirs") == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("draw_y_m,draw_z_m\n-0.3,-0.1\n", "lacks the column landing_y_m"),
        (f"{HEAD},speed\n", "unknown column 'speed'"),
        (f"{HEAD},landing_y_m\n", "two columns landing_y_m"),
        ("", "lacks the column draw_y_m"),
        (f"{HEAD}\n-0.3,-0.1,far\n", "line 2: landing_y_m must be a number"),
        (f"{HEAD}\n-0.3,-0.1,1\n-0.3,,1\n", "line 3: a draw needs"),
        (f"{HEAD}\n0.3,-0.1,1\n", "line 2: draw_y_m must lie between -20 and 0 m"),
        (f"{HEAD}\n-0.3,-0.1,192.5\n", "line 2: landing_y_m must lie between 0 and 20 m"),
        (f"{HEAD}\n-0.3,-0.1,-0.1\n", "leave it empty where it did not land"),
        (f"{HEAD}\n-0.3,-0.1,1,9,9\n", "line 2: more cells than the 3 columns"),
        (
            f"{HEAD},target_m,method\n-0.3,-0.1,1,1.9,mine\n",
            "line 2: method 'mine' is not in params.yaml, which has ours, theirs",
        ),
        (
            f"{HEAD},target_m,method\n-0.3,-0.1,1,2.425,ours\n-0.3,-0.1,1,3.0,theirs\n",
            r"line 3: target_m 3.0 lies outside the target on the floor, \[1.425, 2.425\], where",
        ),
        ((f"{HEAD}\n-0.3,-0.1,1\n").encode("utf-16"), "not UTF-8"),
        (f"{HEAD}\n".encode() + b"1" * 200_000, "cannot be read as CSV"),
    ],
)
def test_refuses_what_no_launch_can_have_done(tmp_path, text: str | bytes, message: str) -> None:
    with pytest.raises(UserError, match=message) as refused:
        read(tmp_path, text)
    assert str(refused.value).startswith(str(tmp_path / "toy.csv"))
    assert "\n" not in str(refused.value)


def test_the_bands_own_file_is_taken(tmp_path) -> None:
    for name in ("README.md", "toy.csv", ".~lock.toy.csv#", "._toy.csv"):
        (tmp_path / name).touch()
    assert file_of(tmp_path, "toy", ("toy", "other")) == tmp_path / "toy.csv"
    assert file_of(tmp_path, "other", ("toy", "other")) is None
    assert file_of(tmp_path / "nowhere", "toy", ("toy",)) is None


def test_a_file_of_no_band_is_refused(tmp_path) -> None:
    """Nobody would read it, and nobody would say so."""
    for name in ("orange.csv", "toy.CSV", "toy .csv"):
        (tmp_path / name).write_text(f"{HEAD}\n")
        with pytest.raises(UserError) as refused:
            file_of(tmp_path, "other", ("toy", "other"))
        assert str(refused.value) == (
            f"{tmp_path / name}: no band of params.yaml goes by that name;"
            " call it toy.csv or other.csv"
        )
        (tmp_path / name).unlink()


def test_the_format_is_documented() -> None:
    text = Path("data/trials/measured/README.md").read_text()
    assert all(name in text for name in (*DRAW, LANDING, *MORE["scores"]))
