"""Turn a recording's files into its episodes: signals and clouds on one clock, in frame O.

    python -m stages.episode band1

Reads data/raw/<band>/<recording>/; writes data/episodes/<band>/<recording>/<n>/ for each pull that
the files hold, n = 1, 2, ... by the file's name, then by time: signals.parquet and clouds.parquet.
A pull that cannot be used is left out, with a warning; a file without any that can be used is an
error.
"""

from __future__ import annotations

import sys

from pipeline.layout import Layout
from sling2sim2real.base.files import NotMade, replacing_folder
from sling2sim2real.recording.build import build_episodes
from sling2sim2real.recording.files import once
from stages.start import recording_of_stage, run


def main() -> None:
    params, recording = recording_of_stage()
    layout, number = Layout(), 0
    files = once(layout.files(recording))
    if not files:
        raise NotMade(layout.recorded(recording))
    with replacing_folder(layout.episodes(recording)) as folder:
        for path in files:
            episodes, refused = build_episodes(path, recording.band, params)
            for reason in refused:
                print(f"warning: left out: {reason}", file=sys.stderr)
            for episode in episodes:
                number += 1
                episode.save(folder / str(number))
                force = episode.metadata["preprocessing"]["peak_force"]
                print(
                    f"{recording.key} {number}: {path.name}, grasp {episode.grasp_time:.3f} s,"
                    f" release {episode.release_time:.4f} s, peak force {force:.2f} N,"
                    f" {len(episode.clouds)} clouds",
                    flush=True,
                )


if __name__ == "__main__":
    run(main)
