"""Write a band's card, as one of its recordings has it by the method `run.main`.

    python -m stages.card band1

Reads the recording's files, episodes and clamps, and θ, confidence, policy and trials of its pair;
writes reports/bands/<recording>/: can the band's simulator be trusted, its values, three draws,
pictures, what would help.
"""

from __future__ import annotations

from pipeline.layout import Layout
from sling2sim2real.card.inputs import CardFiles
from sling2sim2real.card.write import write
from stages.start import recording_of_stage, run


def main() -> None:
    params, recording = recording_of_stage()
    layout, pair = Layout(), params.run.pairs[f"{recording.key}-{params.run.main}"]
    files = CardFiles(
        name=recording.key,
        raw=layout.raw(recording),
        episodes=layout.episodes(recording),
        clamps=layout.clamps(recording),
        theta=layout.theta(pair),
        confidence=layout.confidence(pair),
        policy=layout.policy(pair),
        trials=layout.trials(pair),
    )
    card = write(params, recording.band, pair.method, files, layout.card(recording))
    print(f"{recording.key}: {card['verdict']}; wrote {layout.card(recording)}/README.md")


if __name__ == "__main__":
    run(main)
