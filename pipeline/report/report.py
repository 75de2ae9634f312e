"""What every chapter, picture and page of the report is made from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.layout import Layout
from pipeline.params import Params
from pipeline.report.landscape import Landscape, landscape
from pipeline.report.paper import METHOD
from pipeline.report.replay import MethodReplay, replay_method
from pipeline.report.results import Result, Results, gather
from sling2sim2real.drawing.canvas import P, Saving
from sling2sim2real.drawing.styles import Styles, drawn, styles
from sling2sim2real.launching.surface.stored import Stored


@dataclass(frozen=True)
class Report:
    """All that ran, as it is shown.

    Attributes:
        replays: By band and method; of the methods that are drawn.
        styles: By method.
        landscape: Of the first search that refines regions, with its result, where one did.
        root: Of the project, with data/ and reports/.
    """

    params: Params
    results: Results
    replays: dict[str, dict[str, MethodReplay]]
    styles: Styles
    landscape: tuple[Result, Landscape] | None
    root: Path

    @classmethod
    def of(cls, params: Params, root: Path) -> Report:
        """Report on everything in params.run. Raises UserError where an input is missing."""
        results = gather(params, root)
        layout = Layout(root)
        named = styles(dict.fromkeys(result.method for result in results))
        replays = {band: _replays(params, results, band, layout) for band in results.methods}
        searched = next((result for result in results if result.regions), None)
        chart = searched and (
            searched,
            landscape(
                params, searched, results.episodes[searched.band], layout.clamps(searched.pair)
            ),
        )
        return cls(params, results, replays, named, chart, root)

    @property
    def folder(self) -> Path:
        return self.root / "reports"

    @property
    def main(self) -> str:
        """The method that the report is about first: that of the cards."""
        return self.params.run.main

    @property
    def references(self) -> tuple[str, ...]:
        """What others are compared with: the main method, and the paper's where it ran too."""
        theirs = (METHOD,) if METHOD in self.results.shared else ()
        return tuple(dict.fromkeys((self.main, *theirs)))

    def shown(self, methods) -> Styles:
        """The styles of methods, in the order of the run."""
        return {method: style for method, style in self.styles.items() if method in methods}

    def picture(
        self, name: str, alt: str, draw: Saving[P], *arguments: P.args, **named: P.kwargs
    ) -> str:
        """Have `draw` write reports/figures/<name>.png; return the line that shows it."""
        draw(self.folder / "figures" / f"{name}.png", *arguments, **named)
        return f"![{alt}](figures/{name}.png)\n"

    def draws(self, result: Result, targets: np.ndarray) -> np.ndarray:
        """The policy's draws (N, 2) [m] for targets (N,) [m]."""
        return Stored(Layout(self.root).policy(result.pair)).draws(targets)


def _replays(
    params: Params, results: Results, band: str, layout: Layout
) -> dict[str, MethodReplay]:
    """Replays of the methods that are drawn."""
    episode, some = results.episodes[band], drawn(results.shared)
    return {
        method: replay_method(params, result.pair, episode, result.theta, layout)
        for method, result in results.methods[band].items()
        if method in some
    }
