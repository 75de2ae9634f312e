"""What the UI shows of what a stage wrote: pictures and tables, drawn as the report draws them."""

from __future__ import annotations

import base64
import re
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, cast

from pipeline.base.layout import Layout
from stages.start import ungrouped

if TYPE_CHECKING:
    from pipeline.report.run.results import Result, Results

PICTURE = re.compile(r"!\[[^\]]*\]\([^)]*\)\n")
LINK = re.compile(r"\[([^\]]*)\]\((?!https?:)[^)]*\)")  # to a file beside the report
CHAPTERS = ("What came out", "The paper's tables")


def artifact(stage: str, root: Path) -> str:
    """What there is to show of what a stage made, by its name, as markdown; "" of most steps.

    Pictures are in it as data URIs, for Prefect's server keeps no files.
    """
    step, _, item = stage.partition("@")
    make = MAKERS.get(ungrouped(step))
    band, _, method = item.partition("-")
    return "\n".join(make(Path(root), band, method)) if make else ""


def _drawn(name: str, draw: Callable[[Path], None]) -> str:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "picture.png")
        draw(path)
        content = base64.b64encode(path.read_bytes()).decode("ascii")
    return f"![{name}](data:image/png;base64,{content})\n"


def _episode(root: Path, band: str, method: str) -> Iterator[str]:
    from pipeline.episode.episode import Episode
    from pipeline.report.run.figures.pull import pull

    recorded = Episode.load(Layout(root).episode(band))
    yield _drawn("pull", lambda path: pull(path, {band: recorded}, {}, {}))


def _theta(root: Path, band: str, method: str) -> Iterator[str]:
    import pandas as pd

    from pipeline.identify.results.theta import load_theta
    from pipeline.params import load
    from pipeline.report.drawing.styles import styles
    from pipeline.report.run.figures import search
    from pipeline.report.run.tables import parameters
    from pipeline.report.run.tables.benchmark import PAPER
    from pipeline.report.run.tables.cells import markdown

    layout, params, named = Layout(root), load(root / "params.yaml"), styles([method])
    theta = load_theta(layout.theta(band, method), band)
    ready = SimpleNamespace(  # as much of report.results.Result as is there by now
        band=band,
        method=method,
        theta=theta,
        confidence=theta.get("confidence") or {},
        evaluations=pd.read_parquet(layout.evaluations(band, method)),
    )
    searches = {band: {method: cast("Result", ready)}}
    yield _drawn("convergence", lambda path: search.convergence(path, searches, named))
    ran = cast("Results", SimpleNamespace(methods=searches))
    table2 = parameters.identified(ran, params)
    heads, rows = parameters.as_table([row for row in table2 if row.source != PAPER], named)
    turned = [list(pair) for pair in zip(heads, *rows, strict=True)]
    yield markdown((["identified", "value (90 % interval)"], turned))


def _policy(root: Path, band: str, method: str) -> Iterator[str]:
    import pandas as pd

    from pipeline.launching.surface.stored import Stored
    from pipeline.report.drawing.styles import styles
    from pipeline.report.run.figures import policy
    from pipeline.report.run.tables.cells import markdown
    from pipeline.report.run.tables.policies import policies

    stored = Stored(band, method, root)
    named = styles([method])
    result = SimpleNamespace(band=band, method=method, card=stored.card())
    curves = {band: {method: pd.read_parquet(stored.folder / "training.parquet")}}
    yield _drawn("training", lambda path: policy.training(path, curves, named))
    yield markdown(policies(cast("Results", [result]), named))


def _trials(root: Path, band: str, method: str) -> Iterator[str]:
    import pandas as pd

    from pipeline.identify.results.theta import load_theta
    from pipeline.report.drawing.styles import styles
    from pipeline.report.run.figures import landings
    from pipeline.report.run.tables.cells import markdown
    from pipeline.report.run.tables.landings import predictions

    layout, named = Layout(root), styles([method])
    trials = pd.read_parquet(layout.trials(band, method))
    theta = load_theta(layout.theta(band, method), band)
    trusted = {(band, method)} if theta.get("confidence") else set()
    if trials.landing_y.notna().any():
        yield _drawn("landings", lambda path: landings.predictions(path, trials, trusted, named))
    for kind, launched in trials.groupby("kind", sort=True):
        table = predictions(launched) if kind == "predicted" else _errors(launched)
        yield f"{str(kind).capitalize()} launches\n\n{markdown(table)}"


def _errors(trials) -> tuple[list[str], list[list[str]]]:
    """Landing errors of launches by target, as in the report."""
    from pipeline.report.run.tables.cells import centimetres
    from pipeline.report.run.tables.landings import landing_errors

    heads = ["target [m]", "launches", "failed", "mean miss [cm]", "±", "bias [cm]"]
    rows = []
    for target, errors in landing_errors(trials).items():
        where = "all" if target == "all" else f"{target:.3f}"
        counts = str(errors.launches), str(errors.failed)
        figures = (centimetres(value) for value in (errors.mean, errors.std, errors.bias))
        rows.append([where, *counts, *figures])
    return heads, rows


def _report(root: Path, band: str, method: str) -> Iterator[str]:
    text = (root / "reports" / "README.md").read_text(encoding="utf-8")
    for chapter in text.split("\n## ")[1:]:
        title, _, content = chapter.partition("\n")
        if title in CHAPTERS:
            without_links = LINK.sub(r"\1", PICTURE.sub("", content))
            yield f"## {title}\n{without_links}"


MAKERS: dict[str, Callable[[Path, str, str], Iterator[str]]] = {
    "episode": _episode,
    "theta": _theta,
    "policy": _policy,
    "trials": _trials,
    "report": _report,
}
