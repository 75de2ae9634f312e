"""`sling add-band`: all of it or nothing."""

import difflib
from pathlib import Path

import pytest

from pipeline.params import load
from sling2sim2real.base.errors import UserError
from sling2sim2real.cli.preflight.add_band import add_band
from tests.project import DEFAULTS, contents


def add(project: Path, recording: Path, name: str = "red", **changes) -> str:
    values = {"mass": 0.0408, "root": project, **changes}
    return add_band(name, [recording], **values)


def test_a_band_is_added_and_nothing_else_changes(project, seen, blind) -> None:
    before = (project / "params.yaml").read_text().splitlines()
    message = add(project, seen[0]).splitlines()
    assert message[0] == "red added, 1 pull"
    assert message[1].startswith("  seen.mcap: peak force")
    assert any("pictures come at 15 Hz" in line for line in message[2:])  # what costs accuracy
    assert message[-1] == "  assumed: --diameter 0.01 and --rest-length 0.52"
    after = (project / "params.yaml").read_text().splitlines()
    lines = [x for x in difflib.ndiff(before, after) if x[0] in "+-"]
    assert len([x for x in lines if x[0] == "-"]) == 1  # run.own
    assert [x[2:] for x in lines if x[0] == "+"][1:] == [
        "  - red",
        "  red:",
        "    source: recording",
        "    mass: 0.0408",
        "    diameter: 0.01",
        "    rest_length: 0.52",
    ]
    where = next(i for i, line in enumerate(after) if line.lstrip().startswith("red:"))
    assert after[where - 1].lstrip().startswith("band3_dip:") and after[where + 5] == ""
    params = load(project / "params.yaml")
    assert params.run.own == ("red",)
    band = params.bands["red"]
    assert (band.source, band.mass, band.diameter, band.rest_length) == (
        "recording",
        0.0408,
        0.010,
        0.52,
    )
    assert (project / "data/raw/red/seen.mcap").read_bytes() == seen[0].read_bytes()

    written = contents(project)
    assert "nothing to do" in add(project, seen[0])
    with pytest.raises(UserError, match="other values"):
        add(project, seen[0], mass=0.05)
    with pytest.raises(UserError, match="holds other recordings already"):
        add(project, blind[0])
    assert contents(project) == written

    (project / "data/raw/red/seen.mcap").unlink()  # as in a clone of a project that has the band
    add(project, seen[0])
    assert contents(project) == written


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"name": "Red Band"}, "band name"),
        ({"name": "../red"}, "band name"),
        ({"name": "band1"}, "other values"),
        ({"mass": -1.0}, "mass"),
        ({"mass": 40.8}, "mass"),
        ({"diameter": 0.0}, "diameter"),
        ({"rest_length": float("nan")}, "rest_length"),
        ({"recording": Path("missing.mcap")}, "no such file"),
        ({"recording": DEFAULTS}, "not an MCAP"),
        ({"recording": Path("tests")}, "tests: is a folder"),
        ({"recording": Path("/dev/null")}, "is not a file"),
        ({"name": "measured"}, "bands.measured: data/trials/measured"),
        ({"rest_length": 0.2}, "bands.red.rest_length: 0.2 must be longer"),
        ({"rest_length": 1.2}, "no picture shows the band drawn taut at a rest length of 1.2 m"),
    ],
)
def test_bad_input_writes_nothing(project, seen, changes, words) -> None:
    before = contents(project)
    with pytest.raises(UserError, match=words) as caught:
        add(project, **{"recording": seen[0], **changes})
    assert "\n" not in str(caught.value)
    assert contents(project) == before


def test_a_recording_that_cannot_be_used_writes_nothing(project, blind) -> None:
    before = contents(project)
    with pytest.raises(UserError, match="empty mask"):
        add(project, blind[0])
    assert contents(project) == before
