"""One band: landings, predictions, the recording beside the simulation, the search, the policy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pipeline.drawing.styles import Styles, drawn
from pipeline.report.figures import confidence, episode, policy, search
from pipeline.report.report import Report
from pipeline.report.results import Result, has_another_loss
from pipeline.report.tables import identified, landings, policies
from pipeline.report.tables.cells import markdown

SOURCE = {
    "rig": "recorded by the **virtual rig**, whose rubber follows another law than the simulator",
    "recording": "a recording that was brought in",
}
PREDICTED = {
    "measured": "The measured landings took no part in the identification.",
    "virtual": "The launches of the rig took no part in the identification.",
}
ERRORS = """\
Error in per cent of the landing distance, of every launch that came down, outside the target area
too; bias is its signed mean, predicted less landed; *not predicted* are launches whose simulation
fails, which the means leave out; *beyond* marks draws that stretch the band further than the
recording did."""


@dataclass(frozen=True)
class Band:
    """What ran on a band."""

    report: Report
    name: str

    @property
    def methods(self) -> dict[str, Result]:
        return self.report.results.methods[self.name]

    @property
    def near(self) -> dict[str, Result]:
        """The methods that its own pictures have room for."""
        return {method: self.methods[method] for method in drawn(self.methods)}

    @property
    def styles(self) -> Styles:
        return {method: self.report.styles[method] for method in self.methods}

    @property
    def near_names(self) -> str:
        return " and ".join(self.styles[method].name for method in self.near)

    def picture(self, name: str, alt: str, draw: Callable[..., None], *arguments) -> str:
        return self.report.picture(f"{self.name}-{name}", alt, draw, *arguments)


def bands(report: Report) -> str:
    """A chapter a band."""
    return "\n".join(_chapter(Band(report, name)) for name in report.params.run.bands)


def _chapter(band: Band) -> str:
    about = band.report.params.bands[band.name]
    text = [
        f"## {band.name}\n",
        f"{about.mass * 1e3:g} g, {about.rest_length * 100:g} cm between the clamps,"
        f" {about.diameter * 1e3:g} mm thick; {SOURCE[about.source]}.\n",
    ]
    for part in (_predictions, _recording, _search, _confidence, _policy):
        text += part(band)
    return "\n".join(text)


def _predictions(band: Band) -> list[str]:
    text, trials = [], band.report.results.trials
    trials = trials[trials.band == band.name]
    for kind, words in PREDICTED.items():
        table = landings.prediction_summary(band.report.results, band.name, kind, band.styles)
        if table:
            text.append(f"### Predicted and {kind} landings\n\n{words} {ERRORS}\n")
            text.append(markdown(table))
    if trials.landing_y.notna().any():
        drawing = policy.landings, trials, band.styles, list(band.near)
        shown = band.picture("landings", "predicted and actual landings", *drawing)
        text.append(f"Left: {band.near_names}. Right: every method, a dot a launch.\n\n{shown}")
    for method, result in band.near.items():
        for kind, title in (("measured", "launch by launch"), ("predicted", "predictions")):
            launches = result.trials[result.trials.kind == kind]
            if not launches.empty:
                table = markdown(landings.predictions(launches))
                text.append(f"{band.styles[method].name}, {title}:\n\n{table}")
                if kind == "predicted":
                    text.append(
                        "No landing of this policy has been measured. Launch from these draws and"
                        f" put the landings into `data/trials/measured/{band.name}.csv` to"
                        " compare.\n"
                    )
    return text


def _recording(band: Band) -> list[str]:
    report, styles = band.report, band.styles
    recorded, replays = report.results.episodes[band.name], report.replays[band.name]
    shown = {method: replays[method] for method in band.near}
    frames, diameter = episode.moments(recorded), report.params.bands[band.name].diameter
    drawing = recorded, shown, styles
    force = band.picture("force", "force over time", episode.force, *drawing)
    work = band.picture("work", "work over time", episode.work, *drawing)
    clouds = band.picture("clouds", "point clouds", episode.clouds, *drawing, frames, diameter)
    text = [
        "### Recording and calibrated simulation\n\n"
        f"Drawn: {band.near_names}. Force of the band on the hand, both through the"
        " same filter; the size of their difference, x included; and the distance of each frame's"
        f" cloud from the simulated band.\n\n{force}",
        "Work of the band on the hand since the start. Where the curves end apart is the term of"
        f" work in the loss.\n\n{work}",
        "Points that the camera saw (one side of the band) and the simulated band (line: its"
        f" middle, shade: its thickness), with the mean distance of the frame.\n\n{clouds}",
    ]
    if report.params.loss.held_out.blocks:
        text.append(
            "### Held-out data\n\nBlocks of the pull that no search has seen, and the rest of the"
            " pull: mean force error, and mean distance of the clouds. Blocks lie at moments of"
            " their own, harder or easier than the rest, so a ratio says less than methods beside"
            " each other: one that over-fits has the less fitted and the greater held-out"
            f" residual.\n\n{markdown(identified.held_out(replays, styles))}"
        )
    return text


def _search(band: Band) -> list[str]:
    params, styles = band.report.params, band.styles
    own = {m for m in band.methods if has_another_loss(dict(params.methods[m].weights))}
    drawing = search.convergence, band.methods, styles, own
    convergence = band.picture("convergence", "convergence", *drawing)
    text = [
        "### Search\n\n"
        "The printed loss (geom + force + work) of the best θ so far, *best* by each method's own"
        f" loss: the curve of a method with another loss may rise.\n\n{convergence}",
        "Everything that was evaluated, in the unit cube of the search; diagonal: the loss against"
        " one parameter.\n",
    ]
    for method, result in band.near.items():
        drawing = search.corner, result, params.parameters, styles[method].name
        alt = f"every point that {styles[method].name} evaluated"
        text.append(band.picture(f"{method}-corner", alt, *drawing))
    return text


def _confidence(band: Band) -> list[str]:
    """What the posteriors say; nothing where no method in the pictures has one."""
    trusted = {method: result for method, result in band.near.items() if result.confidence}
    if not trusted:
        return []
    styles = band.styles
    marginals = band.picture("marginals", "marginals", confidence.marginals, trusted, styles)
    drawing = confidence.correlation, trusted, styles
    correlation = band.picture("correlation", "correlation of the parameters", *drawing)
    return [
        "### Confidence\n\n"
        "What is known of the band, by all its recordings and observed launches: samples, 90 %"
        f" intervals, and θ*, the mode.\n\n{marginals}",
        correlation,
    ]


def _policy(band: Band) -> list[str]:
    """How policies were trained, their draws, and where each draw of the box lands."""
    report, styles, params = band.report, band.styles, band.report.params
    targets, aims, maps = np.array(params.trials.targets), {}, []
    path = np.linspace(*params.policy.targets, 101)  # from near to far
    for method, result in band.near.items():
        name = styles[method].name
        aims[name] = result.landing_map, report.draws(result, targets)
        way = report.draws(result, path)
        sizes = params.setup.fork_width, params.bands[band.name].rest_length
        drawing = result, way, targets, float(result.trials.recorded_stretch.max()), *sizes
        alt = f"landing map of {name}"
        maps.append(band.picture(f"{method}-map", alt, policy.landing_map, *drawing))
    training = band.picture("training", "training", policy.training, band.methods, styles)
    return [
        f"### Policy\n\n{training}",
        "Draws for the targets of the trials, each in the method's own simulator:\n",
        markdown(policies.aims(aims, targets)),
        "Where each draw of the box lands there, and the policy's path over it:\n",
        *maps,
    ]
