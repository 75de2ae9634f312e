"""Turn one band's recording into its episode: signals and clouds on one clock, in frame O.

    python -m stages.episode band1

Reads data/raw/<band>.mcap; writes data/episodes/<band>/: signals.parquet and clouds.parquet.
"""

from __future__ import annotations

from pipeline.base.layout import Layout
from pipeline.recording.build import build_episode
from stages.start import run, started


def main() -> None:
    params, band = started("band")
    layout = Layout()
    episode = build_episode(layout.recording(band), band, params)
    episode.save(layout.episode(band))
    force = episode.metadata["preprocessing"]["peak_force"]
    print(
        f"{band}: grasp {episode.grasp_time:.3f} s, release {episode.release_time:.4f} s,"
        f" peak force {force:.2f} N, {len(episode.clouds)} clouds"
    )


if __name__ == "__main__":
    run(main)
