"""Write the card of a band as one recording shows it: can it be trusted, its values, three draws, pictures, what would help.

    python -m stages.card band1

Reads the band's recordings, episodes, mounting, θ, confidence, policy and trials; writes
reports/bands/<band>/.
"""

from __future__ import annotations

from sling2sim2real.base.layout import Layout
from sling2sim2real.card.write import write
from stages.start import recording_of_stage, run


def main() -> None:
    params, band, method = started("band", "method")
    card = write(params, band, method)
    print(f"{band} {method}: {card['verdict']}; wrote {Layout().card(band)}/README.md")


if __name__ == "__main__":
    run(main)
