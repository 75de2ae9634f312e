"""What a setting changes, from results whose effect is known."""

import numpy as np
import pytest

from validation.effects import AS_IS, KEY, effects, runs, table

BANDS, SEEDS = ["one", "two"], [1, 2]
ROWS = {AS_IS: "nothing", "other": "`other`", "never run": "never"}


def result(band: str, switch: str, seed: int, **more) -> dict:
    factor = {"one": 1.0, "two": 10.0}[band]
    content = {"youngs_modulus": 1e5 * factor, "peak_force": 0.01, "loss": 1.0, "miss": 0.05}
    key = {"method": "m", "band": band, "recording": 0, "switch": switch, "seed": seed}
    return key | content | more


def all_of(switch: str, **more) -> list[dict]:
    return [result(band, switch, seed, **more) for band in BANDS for seed in SEEDS]


def test_a_setting_is_compared_band_by_band_and_seed_by_seed() -> None:
    changed = [
        row | {"youngs_modulus": 1.2 * row["youngs_modulus"], "peak_force": -0.02, "miss": 0.08}
        for row in all_of("other")
    ]
    figures = effects(all_of(AS_IS) + changed, [AS_IS, "other", "never run"], ["m"], BANDS)["m"]
    assert set(figures["rig"]) == {AS_IS, "other"}
    other = figures["rig"]["other"]
    assert other["runs"] == 4 and other["failed"] == 0
    assert other["youngs_modulus_change"]["mean"] == pytest.approx(0.2)
    assert other["youngs_modulus_change"]["std"] == pytest.approx(0, abs=1e-12)
    assert other["miss_change"]["mean"] == pytest.approx(0.03)
    heads, _, *lines = table({"m": figures, "n": {}}, ROWS, {"m": "mine", "n": "yours"})
    names = "mine: E | force | miss | yours: E | force | miss"
    assert heads == f"| as the paper has it | bands | {names} |"
    assert lines == [
        "| nothing | rig | 550 kPa | +1.0 % | 5.0 cm |  |  |  |",
        "| `other` | rig | +20.0 % | −2.0 % | 8.0 cm (**+3.0, +3.0 to +3.0**) |  |  |  |",
    ]
    assert runs({"m": figures}, ROWS, {"m": "mine"}) == ["mine: 4 a row."]


def test_a_change_that_may_be_none_is_not_bold() -> None:
    changed = [row | {"miss": 0.05 + 0.02 * (-1) ** row["seed"]} for row in all_of("other")]
    figures = effects(all_of(AS_IS) + changed, [AS_IS, "other"], ["m"], BANDS)
    line = table(figures, ROWS, {"m": "mine"})[-1]
    assert line.endswith("| 5.0 cm (+0.0, −2.0 to +2.0) |")


def test_a_band_that_is_not_of_the_rig_stands_by_itself() -> None:
    more = {
        "band": "orange",
        "method": "m",
        "recording": 0,
        "seed": 1,
        "peak_force": 0.0,
        "youngs_modulus": 1e6,
    }
    orange = [more | {"switch": AS_IS, "miss": 0.02}, more | {"switch": "other", "miss": 0.04}]
    figures = effects(all_of(AS_IS) + all_of("other") + orange, [AS_IS, "other"], ["m"], BANDS)
    assert figures["m"]["rig"]["other"]["miss"]["mean"] == pytest.approx(0.05)
    _, plain, _, other = table(figures, ROWS, {"m": "mine"})[-4:]
    assert plain == "| nothing | orange | 1000 kPa | +0.0 % | 2.0 % |"
    assert other == "| `other` | orange | +0.0 % | +0.0 % | 4.0 % (+2.0) |"


def test_what_failed_or_missed_is_counted_and_takes_no_part() -> None:
    results = all_of(AS_IS) + all_of("other", miss=0.07)
    results[-1] = {key: results[-1][key] for key in KEY}
    results[-1]["failed"] = "no simulation converges"
    results[-2]["miss"] = None
    figures = effects(results, [AS_IS, "other"], ["m"], BANDS)
    other = figures["m"]["rig"]["other"]
    assert (other["runs"], other["failed"], other["miss"]["n"]) == (4, 1, 2)
    assert other["youngs_modulus"]["n"] == 3
    assert np.isclose(other["miss_change"]["mean"], 0.02)
    summary = ["mine: 4 a row.", "mine, `other`: 1 of 4 found no θ."]
    assert runs(figures, ROWS, {"m": "mine"}) == summary


def test_a_setting_of_which_nothing_is_known_has_no_figure() -> None:
    failed = [{key: row[key] for key in KEY} | {"failed": "why"} for row in all_of("other")[:1]]
    figures = effects(all_of(AS_IS) + failed, [AS_IS, "other"], ["m"], BANDS)
    assert table(figures, ROWS, {"m": "mine"})[-1] == "| `other` | rig | no θ | no θ | no θ |"
    summary = ["mine: 4 a row, 1 `other`.", "mine, `other`: 1 of 1 found no θ."]
    assert runs(figures, ROWS, {"m": "mine"}) == summary
