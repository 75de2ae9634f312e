"""How well a recording tells the camera's clock, and whether it knows how well.

    python -m validation.campaigns.camera_clock

The rig records each of its bands ten times by the informative pull; the camera's stamps are made
late by up to REACH more, either way. What `correct_delays` finds is held against the rig's own
times, which it does not see: against the pose, by where the hand is seen; against the release, as
the force shows it, which is what pictures of the recoil are compared by; and against the force's
stamps, whose samples show the release within a millisecond. Recordings are kept in --work, with
lines of results.jsonl: a run that was killed goes on from there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from pipeline.base import errors
from pipeline.params import Params, load
from pipeline.recording.delays import Delays, correct_delays
from pipeline.recording.input.reader import read_recording
from pipeline.recording.pulls import Pull
from rig.draw import sampled
from rig.recorder.record import record
from validation.campaigns import runner
from validation.campaigns.runner import made_once
from validation.projects import DEFAULTS
from validation.reports import plain, write_report
from validation.rubbers import DEVELOP, with_rubbers

WORK, REPORT = Path(".checkpoints/camera_clock"), Path("reports/validation/camera-clock.json")
BANDS, TEN = ("band1", "band2", "band3"), 10
REACH = 0.3  # s
MOST, FACTOR = 3e-4, 1.5  # s rms, and by which the stated error may be off


@dataclass(frozen=True)
class Recorded:
    """One recording of a rig's band."""

    band: str
    number: int

    @property
    def params(self) -> Params:
        return with_rubbers(load(DEFAULTS), DEVELOP, self.number, "informative")

    @property
    def late(self) -> float:
        """What the camera's stamps are made late by [s]."""
        rng = np.random.default_rng([42, self.number, *self.band.encode()])
        return float(rng.uniform(-REACH, REACH))


def measured(job: Recorded, work: Path) -> dict:
    """What was found, and by how much it and its parts are off [s]."""
    path, params = work / f"{job.band}-{job.number}.mcap", job.params
    work.mkdir(parents=True, exist_ok=True)
    truth = path.with_suffix(".json")
    slip = made_once(truth, lambda: {"slip": record(params, job.band, path).slip_time})["slip"]
    pull = Pull.of(read_recording(path, params.setup, params.episode.delays), params.setup)
    delays = correct_delays(pull.shifted(camera=-job.late), params)[1]
    latency = sampled(params, job.band).rig.pose_latency
    late = delays.camera.value - job.late
    return {
        "late": job.late,
        "found": vars(delays.camera),
        "off": {
            "pose": late - delays.pose.rest + latency,
            "release": late + pull.release.time - slip,
            "force": late,
        },
        "stated": stated(delays, pull.release.error),
    }


def stated(delays: Delays, release: float) -> dict[str, float]:
    """Standard deviations [s]; `release` is that of the release on the force's clock."""
    camera, pose = delays.camera.left or np.nan, delays.pose.left or np.nan
    tied = float(np.hypot(camera, pose))
    return {"pose": camera, "release": tied, "force": float(np.hypot(tied, release))}


def figures(lines: list[dict]) -> dict:
    """Errors [s] by what the camera's clock is held against, and how true those stated are."""
    good, result = [line for line in lines if "failed" not in line], {}
    for name in ("pose", "release", "force") if good else ():
        off, stated_errors = (
            np.array([line[part][name] for line in good]) for part in ("off", "stated")
        )
        rms, stated_rms = np.sqrt(np.mean(off**2)), np.sqrt(np.mean(stated_errors**2))
        result[name] = {
            "rms": rms,
            "mean": off.mean(),
            "worst": np.abs(off).max(),
            "stated_rms": stated_rms,
            "stated_over_rms": stated_rms / rms,
            "met": bool(rms <= MOST and 1 / FACTOR <= stated_rms / rms <= FACTOR),
        }
    return result


def main() -> None:
    args = runner.parser(__doc__, REPORT, WORK).parse_args()
    todo = [Recorded(band, number) for number in range(TEN) for band in BANDS]
    lines = runner.results_of(args, partial(measured, work=args.work), todo)
    content = {
        "kind": "virtual",
        "asked": "At most 0.3 ms rms over 30 recordings of the rig, and the stated error true"
        " within a factor of 1.5.",
        "jobs": [len(lines), len(todo)],
        "settings": {"reach_s": REACH, "plan.dips": [dict(d) for d in load(DEFAULTS).plan.dips]},
        "figures": plain(figures(lines), 4),
        "recordings": plain(lines, 5),
    }
    for name, summary in write_report(args.report, content)["figures"].items():
        print(name, summary)


if __name__ == "__main__":
    errors.run(main)
