"""Trials: measured launches read from CSV, and the stretch of a draw."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.episode import Episode
from pipeline.errors import UserError
from pipeline.policy.trials import SCHEMA, read_measured, recorded_stretch, stretch_of, table


def test_stretch_of_a_345_triangle() -> None:
    """Tips 6 apart, drawn 4 back: two sides of length 5, whatever the direction of the draw."""
    points = np.array([[0, -4, 0], [0, 0, -4], [0, -2.4, -3.2]])
    np.testing.assert_allclose(stretch_of(points, 6.0, 8.0), 10 / 8)
    assert stretch_of(np.array([[3.0, 0, 0]]), 6.0, 8.0)[0] == pytest.approx(6 / 8)


def test_the_recorded_stretch_counts_only_while_the_band_is_held() -> None:
    time = np.arange(5.0)
    position = np.array([[0, -9, 0], [0, 0, 0], [0, -4, 0], [0, -1, 0], [0, -9, 0]], float)
    nothing = np.zeros((5, 3))
    episode = Episode(
        "toy", time, position, nothing, nothing, time, time, [], 1.0, 3.0, np.zeros(3)
    )
    assert recorded_stretch(episode, 6.0, 8.0) == pytest.approx(10 / 8)


def test_reads_measured_launches_of_a_method(tmp_path) -> None:
    file = tmp_path / "toy.csv"
    file.write_text(
        "\ufeffdraw_y_m, draw_z_m,landing_y_m,target_m,method\n"
        "-0.3,-0.17,2.2,,\n-0.3,-0.17,1.9,1.925,ours\n-0.3,-0.17,1.8,1.925,theirs\n"
        "-0.35,-0.17,,1.925,ours\n"
    )
    rows = read_measured(file, "ours")
    assert [row["landing_y_m"] for row in rows] == [2.2, 1.9, None]
    assert [row["target_m"] for row in rows] == [None, 1.925, 1.925]
    assert len(read_measured(file, "theirs")) == 2


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("draw_y_m,draw_z_m\n-0.3,-0.1\n", "lacks the column landing_y_m"),
        ("draw_y_m,draw_z_m,landing_y_m,speed\n", "unknown column 'speed'"),
        ("", "lacks the column draw_y_m"),
        ("draw_y_m,draw_z_m,landing_y_m\n-0.3,-0.1,far\n", "line 2: landing_y_m must be a number"),
        ("draw_y_m,draw_z_m,landing_y_m\n-0.3,-0.1,1\n-0.3,,1\n", "line 3: a draw needs"),
        ("draw_y_m,draw_z_m,landing_y_m\n0.3,-0.1,1\n", "line 2: draw_y_m must be below 0"),
        ("draw_y_m,draw_z_m,landing_y_m\n-0.3,-0.1,inf\n", "line 2: landing_y_m must be a number"),
    ],
)
def test_refuses_a_bad_csv(tmp_path, text: str, message: str) -> None:
    file = tmp_path / "toy.csv"
    file.write_text(text)
    with pytest.raises(UserError, match=message):
        read_measured(file, "ours")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("draw_y_m,draw_z_m,landing_y_m\n-0.3,-0.1,1\n".encode("utf-16"), "not UTF-8"),
        (b"draw_y_m,draw_z_m,landing_y_m,method\n-0.3,-0.1,1,m\xfcller\n", "not UTF-8"),
        (b"draw_y_m,draw_z_m,landing_y_m\n" + b"1" * 200_000, "cannot be read as CSV"),
    ],
)
def test_refuses_a_file_that_is_no_csv(tmp_path, content: bytes, message: str) -> None:
    file = tmp_path / "toy.csv"
    file.write_bytes(content)
    with pytest.raises(UserError, match=message):
        read_measured(file, "ours")


def test_a_table_counts_trials_by_target_and_keeps_what_failed_empty() -> None:
    predicted = SimpleNamespace(
        landing_y=np.array([1.9, np.nan, 2.0]),
        hold_force=np.array([9.0, np.nan, 31.0]),
        failure=[None, "it broke", None],
    )
    made = table(
        band="toy",
        method="ours",
        kind="virtual",
        draws=np.array([[-0.3, -0.17]] * 3),
        targets=[1.9, 1.9, 2.1],
        predicted=predicted,
        intervals=np.array([[1.8, 2.0], [np.nan, np.nan], [1.9, 2.1]]),
        landing=[1.95, None, None],
        failure=[None, "too far", "too strong"],
        hold_force=predicted.hold_force,
        stretch=np.array([1.4, 1.4, 1.4]),
        recorded=1.6,
    )
    assert made.schema.equals(SCHEMA)
    assert made["trial"].to_pylist() == [1, 2, 1]
    assert made["predicted_y"].to_pylist() == [1.9, None, 2.0]
    assert made["predicted_low"].to_pylist() == [1.8, None, 1.9]
    assert made["predicted_high"].to_pylist() == [2.0, None, 2.1]
    assert made["hold_force"].to_pylist() == [9.0, None, 31.0]
    assert made["landing_y"].null_count == 2
