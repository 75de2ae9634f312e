"""Turn a band's recordings into its episodes: signals and clouds on one clock, in frame O.

    python -m stages.episode band1

Reads the recordings in data/raw/<band>/; writes data/episodes/<band>/<n>/ for each pull that they
hold, n = 1, 2, ... by the recording's name, then by time: signals.parquet and clouds.parquet. A
pull that cannot be used is left out, with a warning; a recording without any that can be used is an
error.
"""

from __future__ import annotations

import sys

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import replacing_folder
from sling2sim2real.base.layout import Layout, NotMade
from sling2sim2real.recording.build import build_episodes
from sling2sim2real.recording.files import once
from stages.start import run, started


def main() -> None:
    params, band = started("band")
    layout, number = Layout(), 0
    recordings = once(layout.recordings(band))
    if not recordings and params.bands[band].source == "rig":
        raise NotMade(layout.recording(band))
    if not recordings:
        raise UserError(
            f"{layout.raw(band)}: no recording is in it; `sling add-recording --band {band}"
            " FILE.mcap` puts one there"
        )
    with replacing_folder(layout.episodes(band)) as folder:
        for path in recordings:
            episodes, refused = build_episodes(path, band, params)
            for reason in refused:
                print(f"warning: left out: {reason}", file=sys.stderr)
            for episode in episodes:
                number += 1
                episode.save(folder / layout.episode(band, number).name)
                force = episode.metadata["preprocessing"]["peak_force"]
                print(
                    f"{band} {number}: {path.name}, grasp {episode.grasp_time:.3f} s,"
                    f" release {episode.release_time:.4f} s, peak force {force:.2f} N,"
                    f" {len(episode.clouds)} clouds",
                    flush=True,
                )


if __name__ == "__main__":
    run(main)
