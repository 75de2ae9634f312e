"""The campaign on more recordings: read, shown in tables, and put in sentences."""

import json

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.params import load
from pipeline.report.run.chapters.repeated import claims
from pipeline.report.run.repeated import FILE, Repeated
from pipeline.report.run.tables.cells import markdown
from pipeline.report.run.tables.repeated import as_table
from tests.project import DEFAULTS, ROOT, with_
from validation.campaigns.ablations import PAPER, rank_correlations, summary
from validation.paired import mean_interval

PARAMS = load(DEFAULTS)
RNG = np.random.default_rng(1)
MISS = {  # cm, of ten recordings
    PAPER: 10 + RNG.normal(0, 0.5, 10),
    "real2sim2real": 30 + RNG.normal(0, 0.5, 10),
    "adam": 5 + RNG.normal(0, 0.5, 10),
    "de": 10 + RNG.normal(0, 0.5, 10),
    "least_squares": 2 + RNG.normal(0, 0.1, 10),
}


def results(slope: float = 1.0) -> list[dict]:
    """As the campaign finds them; a loss that rises with the miss, or falls."""
    return [
        {
            "band": "band1",
            "recording": 1001 + number,
            "method": method,
            "seed": 1,
            "theta": {"youngs_modulus": 2e5},
            "loss": {"total": 1 + slope * miss / 100},
            "error_m": [miss / 100] * 3,
            "seconds": 1.0,
        }
        for method, some in MISS.items()
        for number, miss in enumerate(some)
    ]


def written(root, some: list[dict]) -> Repeated:
    """What the project reads of a campaign with such results."""
    ranks = mean_interval(rank_correlations(some, MISS))
    content = {
        "figures": summary(some, ["band1"], list(MISS)),
        "rank_correlation_of_loss_and_miss": {"over_recordings": ranks},
        "settings": {
            "optimizer": PARAMS.optimizer.model_dump(),
            "methods": {name: PARAMS.methods[name].model_dump() for name in MISS},
            "targets_m": PARAMS.trials.targets,
        },
    }
    (root / FILE).parent.mkdir(parents=True)
    (root / FILE).write_text(json.dumps(content, default=list))
    return Repeated.load(root)


def test_findings_hold_do_not_hold_or_are_open(tmp_path) -> None:
    ours, geometry, search, _, why = claims(written(tmp_path, results()), PARAMS)
    assert f"**ours** {MISS['least_squares'].mean():.1f} cm" in ours
    assert f"**Sling2Sim2Real** {MISS[PAPER].mean():.1f} cm" in ours
    farther = (MISS["real2sim2real"] - MISS[PAPER]).mean()
    nearer = (MISS[PAPER] - MISS["adam"]).mean()
    assert f"holds against Real2Sim2Real (+{farther:.1f} cm)" in geometry
    assert f"does not hold against Adam_L (−{nearer:.1f} cm)" in search
    assert "is open against DE_L" in search
    assert "lands nearer (rank correlation on one recording: +1.00" in why


def test_where_a_lower_loss_lands_farther_it_is_said(tmp_path) -> None:
    why = claims(written(tmp_path, results(slope=-1.0)), PARAMS)[-1]
    assert "does not land nearer" in why and "−1.00" in why


def test_tables_have_the_rows_that_ran(tmp_path) -> None:
    repeated = written(tmp_path, results())
    heads, rows = as_table(repeated, 3)
    assert [row[0] for row in rows] == ["DE_L", "Adam_L", "Sling2Sim2Real"]
    assert heads[1:3] == ["Band 1 (soft)", "all"]
    text = markdown((heads, rows))
    adam, paper = (row for row in rows if row[0] != "DE_L")
    assert adam[3].startswith("**−") and float(adam[4]) < 0.05 and paper[3:] == ["–", "–"]
    assert f"{MISS['adam'].mean():.1f} (" in text


def test_other_settings_of_the_campaign_are_named_beside_its_numbers(tmp_path) -> None:
    """Only of methods that the campaign had, and of keys that change what it found."""
    repeated = written(tmp_path, results())
    assert repeated.changed_settings(PARAMS) == []
    ours = with_(PARAMS, "optimizer", cma_rollouts=840)
    ours = with_(with_(ours, "trials", targets=(1.9,)), "methods", bo=PARAMS.methods["de"])
    ours = with_(ours, "methods.adam", mounting=False)
    keys = ["methods.adam.mounting", "optimizer.cma_rollouts", "trials.targets"]
    assert [setting.key for setting in repeated.changed_settings(ours)] == keys
    message = claims(repeated, ours)
    assert f"other settings than this run: {', '.join(keys)}." in " ".join(message)


def test_a_file_of_something_else_is_one_line(tmp_path) -> None:
    assert Repeated.load(tmp_path) is None
    (tmp_path / FILE).parent.mkdir(parents=True)
    (tmp_path / FILE).write_text("[]")
    with pytest.raises(UserError, match="ablations.json: is not what .* `git checkout`"):
        Repeated.load(tmp_path)


def test_the_committed_campaign_can_be_read() -> None:
    repeated = Repeated.load(ROOT)
    assert {"band1", "band2", "band3"} == set(repeated.bands)
    assert len(claims(repeated, PARAMS)) >= 4
