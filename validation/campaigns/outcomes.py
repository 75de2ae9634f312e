"""What becomes of damaged recordings, each run from file to episode in one process.

    python -m validation.campaigns.outcomes FOLDER FAMILY CONTAINER FIRST END

prints two lines of JSON a recording: which it is before it runs, what came of it after. A timer
ends the process where one hangs; the last line then names the culprit.
"""

from __future__ import annotations

import faulthandler
import json
import resource
import signal
import sys
import time
import traceback
from pathlib import Path

import numpy as np

from pipeline.base.errors import UserError
from pipeline.episode.episode import Episode
from pipeline.params import Params
from pipeline.recording.build import episode_of, process
from pipeline.recording.processed import Processed
from validation.campaigns.damage import mutated
from validation.recordings.small import CHECKED, small_params

SAME, SAID, LINE = "same episode", "episode with loss said", "one line"
OTHER = "another episode"  # which only a recording without checksums may become
FAULT = "fault"
HANGS = 10.0  # s of the processor, which others may share
BLOCKS = 600.0  # s on the clock
MOST = 2 * 2**30  # bytes
LONGEST = 2000  # characters of a line
WORDS = 300  # characters that are kept of what was said


def name_of(family: str, container: str) -> str:
    return f"{family}-{container}"


def same(a: Episode, b: Episode) -> bool:
    """Whether two episodes hold the same numbers."""
    names = ("time", "position", "velocity", "force", "opening", "cloud_time", "camera")
    if any(not np.array_equal(getattr(a, n), getattr(b, n), equal_nan=True) for n in names):
        return False
    events = [(e.grasp_time, e.release_time, len(e.clouds)) for e in (a, b)]
    clouds = zip(a.clouds, b.clouds, strict=False)
    return events[0] == events[1] and all(np.array_equal(x, y) for x, y in clouds)


def message(done: Processed) -> list[str]:
    """Everything by which a user learns of damage."""
    words = [*done.pull.recording.losses, *done.pull.recording.notes]
    if done.clouds.damaged or done.clouds.unpaired:
        words.append(f"{done.clouds.damaged} pictures damaged, {done.clouds.unpaired} unpaired")
    return words


def outcome(
    path: Path, params: Params, whole: Episode, usual: list[str], checked: bool
) -> tuple[str, str]:
    """What came of one recording, and the words beside the usual ones.

    Args:
        path: The damaged recording.
        params: Of `small_params`.
        whole, usual: The undamaged recording's episode, and what is said of it.
        checked: Whether the container has checksums.
    """
    try:
        done = process(path, params.bands["band1"], params)
        episode = episode_of(done, "band1", params)
    except UserError as error:
        line = str(error)
        clear = line.isprintable() and str(path) in line and len(line) < LONGEST
        return (LINE, line) if clear else (FAULT, f"no clear line: {line!r}")
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        return (
            FAULT,
            f"{type(error).__name__}: {error} ({Path(place.filename).name}:{place.lineno})",
        )
    words = [text for text in message(done) if text not in usual]
    if words:
        return SAID, "; ".join(words)
    if same(episode, whole):
        return SAME, ""
    return (FAULT, "silently another episode") if checked else (OTHER, "")


def main(folder: Path, family: str, container: str, seeds: range) -> None:
    resource.setrlimit(resource.RLIMIT_DATA, (2 * MOST, 2 * MOST))  # others want memory too
    params, name = small_params(), name_of(family, container)
    original = folder / f"{name}.mcap"
    content = original.read_bytes()
    done = process(original, params.bands["band1"], params)
    whole, usual = episode_of(done, "band1", params), message(done)
    path = folder / f"{name}-{seeds.start}-damaged.mcap"
    faulthandler.enable()
    faulthandler.register(signal.SIGPROF, chain=True)
    for seed in seeds:
        path.write_bytes(mutated(content, name, seed))
        recording = {"family": family, "container": container, "seed": seed}
        print(json.dumps(recording), flush=True)
        signal.setitimer(signal.ITIMER_PROF, HANGS)
        faulthandler.dump_traceback_later(BLOCKS, exit=True)
        start = time.process_time()
        came, words = outcome(path, params, whole, usual, container in CHECKED)
        seconds = time.process_time() - start
        faulthandler.cancel_dump_traceback_later()
        signal.setitimer(signal.ITIMER_PROF, 0)
        held = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        if held > MOST:
            came, words = FAULT, f"{held / 2**30:.1f} GiB of memory"
        line = {**recording, "outcome": came, "words": words[:WORDS], "s": seconds, "bytes": held}
        print(json.dumps(line), flush=True)
        if held > MOST:
            break  # what comes next is not to blame
    path.unlink(missing_ok=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:4], range(int(sys.argv[4]), int(sys.argv[5])))
