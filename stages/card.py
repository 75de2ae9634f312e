"""Write one band's folder: what `sling aim` and its like need, and a card.

    python -m stages.card band1 least_squares

Reads the band's recordings, episodes, mounting, θ, confidence, policy and trials; writes
reports/bands/<band>/.
"""

from __future__ import annotations

from pipeline.band_folder import write
from sling2sim2real.base.layout import Layout
from stages.start import run, started


def main() -> None:
    _, band, method = started("band", "method")
    card = write(band, method)
    print(f"{band} {method}: {card['verdict']}; wrote {Layout().card(band)}/card/README.md")


if __name__ == "__main__":
    run(main)
