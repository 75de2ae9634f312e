"""Write a band's folder, as one of its recordings has it by the method `run.main`.

    python -m stages.card band1

Reads the recording's files, episodes and clamps, and θ, confidence, policy and trials of its pair;
writes reports/bands/<recording>/: what `sling aim` needs, and in card/ whether the band's simulator
can be trusted, its values, three draws, pictures, what would help.
"""

from __future__ import annotations

from pipeline.band_folder import write
from pipeline.layout import Layout
from stages.start import recording_of_stage, run


def main() -> None:
    params, recording = recording_of_stage()
    pair = params.run.pairs[f"{recording.key}-{params.run.main}"]
    card = write(pair)
    print(f"{recording.key}: {card['verdict']}; wrote {Layout().card(pair)}/card/README.md")


if __name__ == "__main__":
    run(main)
