"""Choose θ*, the best of everything that was evaluated, and say how sure it is.

    python -m stages.theta band1 sling2sim2real

Reads data/history/ and data/refined/<band>/<method>.parquet, data/episodes/<band>/ and
data/mounting/<band>.json; writes data/theta/<band>/<method>.json, and samples of the posterior
with profile curves to data/confidence/<band>/<method>.json. Where too many simulations around θ*
fail to tell how sure it is, "confidence" is null and there are no samples. SLING_WORKERS says on
how many threads.
"""

from __future__ import annotations

import sys

from pipeline.base.files import write_json
from pipeline.base.layout import Layout, made
from pipeline.base.machine import workers
from pipeline.confidence.rounds import NoConfidence
from pipeline.confidence.summary import confidence
from pipeline.episode.pull import launch_history
from pipeline.objective.session import load_episode
from pipeline.params.identification import LAWS
from pipeline.search.history import History, theta_content
from pipeline.sling.load import load_sling
from pipeline.sling.material import THETA
from pipeline.sling.rubber import RUBBER
from stages.start import run, started


def main() -> None:
    params, band, method = started("band", "method")
    layout = Layout()
    sources = made(layout.history(band, method)), made(layout.refined(band, method))
    law, episode = params.methods[method].law, load_episode(band)
    about = {"law": law, "history": launch_history(episode)} if law == RUBBER else {}
    history = History.load(method, (*THETA, *LAWS[law]), *sources)
    content, sling = theta_content(history, band, about), load_sling(params, band, law=law)
    try:
        known, kept = confidence(params, method, episode, sling, content, workers=workers())
    except NoConfidence as error:  # θ* is what it is, and all that follows does without
        print(f"warning: {method}: {error}", file=sys.stderr)
        known, kept = None, {"samples": []}
    content["confidence"] = known
    write_json(layout.confidence(band, method), kept | {"band": band})
    write_json(layout.theta(band, method), content)
    print(f"{band} {method}: loss {content['loss']['total']:.5g}")
    for name, value in content["theta"].items():
        print(f"  {name} {value:.4g}{_trust(known['parameters'][name]) if known else ''}")


def _trust(about: dict) -> str:
    if about.get("fixed"):
        return " (fixed)"
    word = "" if about["identifiable"] else ", not identifiable"
    return f" ({about['low']:.4g} to {about['high']:.4g}{word})"


if __name__ == "__main__":
    run(main)
