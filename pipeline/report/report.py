"""Write reports/: report and appendix with their pictures and pages, tables, summary.json."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.params import Params
from pipeline.report import paper, tables
from pipeline.report.data import Result, Run, gather
from pipeline.report.figures import landings, search, simulation
from pipeline.report.tables import markdown
from sling2sim2real.base.files import replacing, write_json, write_text
from sling2sim2real.base.target import TARGET_AREA
from sling2sim2real.base.template import filled
from sling2sim2real.drawing.canvas import P, Saving
from sling2sim2real.drawing.page import page
from sling2sim2real.identification.results.ranges import searched
from sling2sim2real.settings.identification import POSTERIOR

HERE = Path(__file__).parent
HTML = {"README": "index", "appendix": "appendix"}  # names of pages
LINK = re.compile(rf"\]\(((?:bands/[^)/]+/card/)?)({'|'.join(HTML)})\.md\)")
CONVERGED = 5760  # rollouts by which seeds of the paper's search agree (docs/paper.md)
TARGETS = 101  # of the policy's path that is drawn, from the nearest to the farthest


def write(params: Params, root: str | Path = ".") -> None:
    """Write the report of everything in params.run. Raises UserError where an input is missing."""
    report = Report(gather(params, root), Path(root, "reports"))
    texts = {"README": report.results(), "appendix": report.appendix()}
    for name, text in texts.items():
        write_text(report.folder / f"{name}.md", text)
        write_page(report.folder, name, text)
    write_json(report.folder / "summary.json", tables.summary(report.run))


def write_page(folder: Path, name: str, text: str) -> None:
    """Write <name>.md as HTML into `folder`, where its pictures lie: a file that needs no network.

    Links to texts become links to their pages. Raises UserError.
    """
    text = LINK.sub(lambda link: f"]({link[1]}{HTML[link[2]]}.html)", text)
    title = "Sling2Sim2Real: " + ("report" if name == "README" else name)
    write_text(folder / f"{HTML[name]}.html", page(text, folder, title))


@dataclass
class Report:
    """The texts of a run; writes the pictures and tables that they show into `folder`."""

    run: Run
    folder: Path

    def __post_init__(self) -> None:
        run = self.run
        launched = run.launched
        self.aimed = launched.loc[launched.target.notna()]
        self.main = {band: of_band[run.main] for band, of_band in run.results.items()}

    def results(self) -> str:
        """The first page: what came out, the paper's tables, its figures."""
        run, params = self.run, self.run.params
        outcome = tables.outcome(run)
        known = tables.identified(run)
        paper_tables = {2: (tables.identified_text(run, known), known)}
        for count, methods in ((1, ()), (3, paper.OPTIMISERS), (4, paper.ABLATIONS)):
            errors = tables.benchmark(run, methods)
            if len(errors):
                table = tables.benchmark_text(run, errors), tables.benchmark_records(errors)
                paper_tables[count] = table
        for count, (_, records) in paper_tables.items():
            self._csv(f"table{count}", records)
        hits = tables.hits(run)
        return filled(
            HERE / "README.md.j2",
            run=run,
            outcome=markdown(outcome),
            virtual=(run.trials.source == "virtual").any(),
            landings=outcome is not None and self._landings(),
            doubts=doubts(run),
            bands=[
                (name, params.bands[recording.band], self._launched(name))
                for name, recording in params.run.recordings.items()
            ],
            tables={n: markdown(t, repeats=False) for n, (t, _) in sorted(paper_tables.items())},
            paper=tables.PAPER,
            sources={source for table, _ in paper_tables.values() for source in table.source},
            area=TARGET_AREA,
            unconverged=self._unconverged(),
            converged=CONVERGED,
            trusted=any(result.confidence for result in run),
            edges=(known.edge != "").any(),
            overview=self._overview(),
            search=self._search(),
            hits=markdown(hits, repeats=False),
            flights=hits is not None and self._flights(),
        )

    def appendix(self) -> str:
        """The second page: predictions, losses, policies, budget."""
        run, params = self.run, self.run.params
        measured = run.launched.query("source == 'measured' and method == @run.main")
        return filled(
            HERE / "appendix.md.j2",
            main=tables.called(run, run.main),
            predicted=markdown(tables.predicted(run), repeats=False),
            measured={b: markdown(tables.launches(of)) for b, of in measured.groupby("band")},
            losses=markdown(tables.losses(run), repeats=False),
            policies=markdown(tables.policies(run), repeats=False),
            explored=params.optimizer.population * (params.optimizer.generations + 1),
            optimizer=params.optimizer,
            policy=params.policy,
            trials=params.trials,
            rig=params.run.rig,
        )

    def _unconverged(self) -> int | None:
        """Rollouts of each search of the paper's loss, where they are too few; else None."""
        params = self.run.params
        optimizer = params.optimizer
        budget = optimizer.population * (optimizer.generations + 1) + optimizer.cma_rollouts
        searches = {params.methods[result.method].search for result in self.run} - {POSTERIOR}
        return budget if searches and budget < CONVERGED else None

    def _csv(self, name: str, records: pd.DataFrame) -> None:
        with replacing(self.folder / "tables" / f"{name}.csv") as temporary:
            records.to_csv(temporary, index=False, float_format="%.4g", lineterminator="\n")

    def _picture(
        self, name: str, alt: str, draw: Saving[P], *arguments: P.args, **named: P.kwargs
    ) -> str:
        """Have `draw` write figures/<name>.png; return the line that shows it."""
        draw(self.folder / "figures" / f"{name}.png", *arguments, **named)
        return f"![{alt}](figures/{name}.png)\n"

    def _launched(self, name: str) -> bool:
        return ((self.run.trials.name == name) & (self.run.trials.source != "predicted")).any()

    def _shown(self, methods) -> dict:
        """The styles of methods, in the order of the run."""
        return {method: style for method, style in self.run.styles.items() if method in methods}

    def _draws(self, result: Result) -> np.ndarray:
        """The policy's draws (N, 2) [m], from the nearest to the farthest target."""
        return result.policy.draws(np.linspace(*self.run.params.policy.targets, TARGETS))

    def _landings(self) -> str | None:
        if self.aimed.empty:
            return None
        shown = self._shown({*self.run.shared} & {*self.aimed.method})
        alt = "how far from its target each launch landed"
        return self._picture("landings", alt, landings.misses, self.aimed, self.run.least, shown)

    def _overview(self) -> str | None:
        run, (band, result) = self.run, next(iter(self.main.items()))
        trials = self.aimed.loc[(self.aimed.band == band) & (self.aimed.method == run.main)]
        if trials.empty:
            return None
        replay = simulation.replayed(run, result)
        drawing = run.episodes[band], replay, self._draws(result), trials
        alt, draw = "from a recording to launches", simulation.overview
        return self._picture("overview", alt, draw, *drawing, run.styles[run.main])

    def _search(self) -> tuple[str, str] | None:
        """Method of the first search that refines regions, and its picture; None of none."""
        result = next((result for result in self.run if result.regions), None)
        if result is None:
            return None
        chart = search.landscape(self.run, result)
        drawing = result, chart, searched(self.run.params, result.method)
        alt = "exploration, regions, CMA-ES"
        shown = self._picture("search", alt, search.search, *drawing)
        return tables.called(self.run, result.method), shown

    def _flights(self) -> tuple[str, str] | None:
        """The first band whose flights are known, and their picture; None where there is none."""
        for band in self.run.results:
            trials = self.run.launched.query("band == @band and source == 'virtual'")
            flew = {*trials.loc[trials.flight_y.notna()].method}
            if flown := self._shown({self.run.main, *paper.BENCHMARK} & flew):
                drawing = landings.flights, trials, self.run.params.setup, flown
                return band, self._picture("flights", f"flights of {band}", *drawing)
        return None


def doubts(run: Run) -> list[str]:
    """What did not go well, a sentence each."""
    trials, first, sentences = run.trials, run.params.run.first, []
    for result in run:
        mine = (trials.name == first[result.band].key) & (trials.method == result.method)
        lost = trials.loc[mine].predicted_y.isna()
        known, wrong = result.confidence, []
        if lost.any():
            wrong.append(f"{lost.sum()} of {len(lost)} launches could not be predicted.")
        if not result.card["training"]["converged"]:
            wrong.append("the policy did **not** converge in its own simulator.")
        if edges := known.get("edges"):
            sides = " and ".join(f"{name} at the {side}" for name, side in edges.items())
            wrong.append(f"{sides} end of its bounds: the true value may lie outside.")
        elif not known.get("settled", True):
            steps = known.get("steps", "all its")
            wrong.append(
                f"the fit had **not settled** after {steps} steps; do not rely on its intervals."
            )
        if known and not any(recording["pictures"] for recording in known["recordings"]):
            wrong.append(
                "no camera frame shows the recoil, so the damping is what other rubbers have; a"
                " launch would say most."
            )
        name = f"{result.band}, {tables.called(run, result.method)}"
        sentences += [f"⚠ {name}: {words}" for words in wrong]
    return sentences + [
        f"⚠ {band}: {count} measured launches name a method that does not run on this band."
        for band, count in run.unused.items()
        if count
    ]
