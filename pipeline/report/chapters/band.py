"""One band: landings, predictions, the recording beside the simulation, the search, the policy."""

from __future__ import annotations

import numpy as np

from pipeline.report.looks import drawn
from pipeline.report.report import Report
from pipeline.report.results import Results
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
Error in per cent of the landing distance; bias is its signed mean, predicted less landed; *not
predicted* are launches whose simulation fails, which the means leave out; *beyond* marks draws that
stretch the band further than the recording did."""


def band_chapter(report: Report, band: str) -> str:
    about = report.params.bands[band]
    text = [
        f"## {band}\n",
        f"{about.mass * 1e3:g} g, {about.rest_length * 100:g} cm between the clamps,"
        f" {about.diameter * 1e3:g} mm thick; {SOURCE[about.source]}.\n",
    ]
    for part in (_predictions, _recording, _search, _policy):
        text += part(report, band)
    return "\n".join(text)


def compared(results: Results, band: str) -> bool:
    """Whether any launch of the band landed, so that a prediction can be held against it."""
    trials = results.trials
    return bool((trials.landing_y.notna() & (trials.band == band)).any())


def _names(report: Report, band: str) -> str:
    return " and ".join(report.looks[method].name for method in drawn(report.results.methods[band]))


def _predictions(report: Report, band: str) -> list[str]:
    results, looks, text = report.results, report.looks, []
    for kind, words in PREDICTED.items():
        table = landings.prediction_summary(results, band, kind, looks)
        if table:
            text.append(f"### Predicted and {kind} landings\n\n{words} {ERRORS}\n")
            text.append(markdown(table))
    if compared(results, band):
        text.append(
            f"Left: {_names(report, band)}. Right: every method, a dot a launch.\n\n"
            f"![predicted and actual landings](figures/{band}-landings.png)\n"
        )
    for method in drawn(results.methods[band]):
        result = results.methods[band][method]
        for kind, title in (("measured", "launch by launch"), ("predicted", "predictions")):
            trials = result.trials[result.trials.kind == kind]
            if not trials.empty:
                table = markdown(landings.predictions(trials))
                text.append(f"{looks[method].name}, {title}:\n\n{table}")
                if kind == "predicted":
                    text.append(
                        "No landing of this policy has been measured. Launch from these draws and"
                        f" put the landings into `data/trials/measured/{band}.csv` to compare.\n"
                    )
    return text


def _recording(report: Report, band: str) -> list[str]:
    text = [
        "### Recording and calibrated simulation\n\n"
        f"Drawn: {_names(report, band)}. Force of the band on the hand, both through the"
        " same filter; the size of their difference, x included; and the distance of each frame's"
        " cloud from the simulated band.\n\n"
        f"![force over time](figures/{band}-force.png)\n\n"
        "Work of the band on the hand since the start. Where the curves end apart is the term of"
        " work in the loss.\n\n"
        f"![work over time](figures/{band}-work.png)\n\n"
        "Points that the camera saw (one side of the band) and the simulated band (line: its"
        " middle, shade: its thickness), with the mean distance of the frame.\n\n"
        f"![point clouds](figures/{band}-clouds.png)\n"
    ]
    table = identified.held_out(report.replays[band], report.looks)
    if table:
        text.append(
            "### Held-out data\n\nBlocks of the pull that no search has seen, and the rest of the"
            " pull: mean force error, and mean distance of the clouds. Blocks lie at moments of"
            " their own, harder or easier than the rest, so a ratio says less than methods beside"
            " each other: one that over-fits has the less fitted and the greater held-out"
            f" residual.\n\n{markdown(table)}"
        )
    return text


def _search(report: Report, band: str) -> list[str]:
    methods, looks = report.results.methods[band], report.looks
    text = [
        "### Search\n\n"
        "The printed loss (geom + force + work) of the best θ so far, *best* by each method's own"
        " loss: the curve of a method with another loss may rise.\n\n"
        f"![convergence](figures/{band}-convergence.png)\n\n"
        "Everything that was evaluated, in the unit cube of the search; diagonal: the loss against"
        " one parameter.\n"
    ]
    chosen = drawn(methods)
    text += [
        f"![every point that {looks[method].name} evaluated](figures/{band}-{method}-corner.png)\n"
        for method in chosen
    ]
    if any(methods[method].confidence for method in chosen):
        text.append(
            "### Confidence\n\n"
            "Least misfit (−2 log likelihood of whitened residuals) with one parameter held, all"
            " others free; the posterior's marginals; its 90 % intervals.\n\n"
            f"![profile curves](figures/{band}-profiles.png)\n\n"
            f"![correlation of the parameters](figures/{band}-correlation.png)\n"
        )
    return text


def _policy(report: Report, band: str) -> list[str]:
    results, looks = report.results.methods[band], report.looks
    methods, targets = drawn(results), np.array(report.params.trials.targets)
    named = {}
    for method in methods:
        result, name = results[method], looks[method].name
        named[name] = result.landing_map, report.draws(band, method, targets)
        if result.robust_card:
            robust = report.draws(band, method, targets, robust=True)
            named[f"{name}, robust"] = result.landing_map, robust
    text = [
        f"### Policy\n\n![training](figures/{band}-training.png)\n",
        "Draws for the targets of the trials, each in the method's own simulator:\n",
        markdown(policies.aims(named, targets)),
        "Where each draw of the box lands there, and the policy's path over it:\n",
    ]
    return text + [
        f"![landing map of {looks[method].name}](figures/{band}-{method}-map.png)\n"
        for method in methods
    ]
