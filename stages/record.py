"""Record one of the virtual rig's bands: data/raw/<band>/<recording>/.

python -m stages.record band1-dips
"""

from __future__ import annotations

from functools import partial

from pipeline.layout import Layout
from rig.recorder.record import record
from sling2sim2real.base.errors import UserError
from stages.start import recording_of_stage, run


def main() -> None:
    params, recording = recording_of_stage()
    if recording.key not in params.run.rig:
        raise UserError(f"{recording.key}: not under run.rig in params.yaml")
    path = Layout().recorded(recording)
    say = partial(print, flush=True)
    record(params, recording.band, path, say, recording=recording.recording)


if __name__ == "__main__":
    run(main)
