"""Launches that are evidence, as they are read from CSV."""

import tempfile
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as some

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.launch_table import expect_apart
from sling2sim2real.base.layout import Layout
from sling2sim2real.identification.posterior.evidence import read_evidence
from sling2sim2real.identification.posterior.launches import Observed

PARAMS = SimpleNamespace(bands={"toy": 0}, trials=SimpleNamespace(actuation_error=0.002))
HEAD = "draw_y_m,draw_z_m,draw_error_m,landing_y_m"


def read(folder: Path, text: str | bytes) -> list[Observed]:
    (folder / "toy.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_evidence(folder, "toy", PARAMS)


@given(
    some.lists(
        some.tuples(
            some.floats(-19, -0.01),
            some.floats(-19, 19),
            some.none() | some.floats(0, 0.099),
            some.floats(0.01, 19.9),
        ),
        max_size=5,
    )
)
def test_what_is_written_is_read_in_its_order(launches) -> None:
    rows = [
        f"{y!r},{z!r},{'' if error is None else repr(error)},{landing!r}"
        for y, z, error, landing in launches
    ]
    with tempfile.TemporaryDirectory() as folder:
        observed = read(Path(folder), "\n".join([HEAD, *rows, ""]))
    assert observed == [
        Observed((y, z), 0.002 if error is None else error, landing)
        for y, z, error, landing in launches
    ]


def test_a_band_without_a_file_has_none(tmp_path) -> None:
    assert read_evidence(tmp_path, "toy", PARAMS) == []
    assert read(tmp_path, "draw_y_m,draw_z_m,landing_y_m\n-0.3,-0.1,2\n") == [
        Observed((-0.3, -0.1), 0.002, 2.0)
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (f"{HEAD},method\n", "unknown column 'method'"),
        (f"{HEAD}\n-0.3,-0.1,0.001,\n", "line 2: a launch that did not land is no evidence"),
        (f"{HEAD}\n-0.3,-0.1,,1\n0.3,-0.1,,1\n", "line 3: draw_y_m must lie between -20 and 0 m"),
        (f"{HEAD}\n-0.3,-0.1,1,2\n", "line 2: draw_error_m must be at least 0 and below 0.1 m"),
        (f"{HEAD}\n-0.3,-0.1,-0.001,2\n", "line 2: draw_error_m must be at least 0"),
        (f"{HEAD}\n-0.3,-0.1,nan,2\n", "line 2: draw_error_m must be a number of metres"),
    ],
)
def test_refuses_what_teaches_nothing(tmp_path, text: str | bytes, message: str) -> None:
    with pytest.raises(UserError, match=message) as refused:
        read(tmp_path, text)
    assert str(refused.value).startswith(str(tmp_path / "toy.csv"))
    assert "\n" not in str(refused.value)


def test_a_file_of_no_band_is_refused(tmp_path) -> None:
    (tmp_path / "other.csv").touch()
    with pytest.raises(UserError, match="no band of params.yaml goes by that name"):
        read_evidence(tmp_path, "toy", PARAMS)


def test_a_launch_is_evidence_or_a_score(tmp_path) -> None:
    layout = Layout(tmp_path)
    for folder in (layout.evidence, layout.measured):
        folder.mkdir(parents=True)
    score, evidence = layout.measured / "toy.csv", layout.evidence / "toy.csv"
    evidence.write_text(f"{HEAD}\n-0.30,-0.1,,2.0\n")
    expect_apart(layout, "toy")
    score.write_text("draw_y_m,draw_z_m,landing_y_m\n-0.3,-0.1,2.01\n-0.3,-0.1,\n")
    expect_apart(layout, "toy")
    score.write_text("draw_y_m,draw_z_m,landing_y_m\n-0.3,-0.10,2\n")
    with pytest.raises(UserError) as refused:
        expect_apart(layout, "toy")
    assert str(refused.value) == (
        f"{evidence}: the launch from -0.3, -0.1 to 2 m stands in {score} too;"
        " it is evidence or a score, never both"
    )
