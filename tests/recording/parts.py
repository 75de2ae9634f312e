"""Recordings joined into one file, and one that is split into a bag's parts."""

from __future__ import annotations

from pathlib import Path

from validation.recordings.bag import messages_of, write_again
from validation.recordings.streams import FRAMES, Bag


def joined(path: Path, recordings: list[Path], gap: float = 0.01) -> list[float]:
    """Write ROS 2 recordings into one file as if each had begun `gap` [s] after the one before.

    Every stamp and time of receipt of a recording is moved alike; /tf_static is the first one's.

    Returns:
        By how much each was moved [s].
    """
    moved, together, end = [], Bag(), 0
    for recording in recordings:
        messages = Bag.read(recording).messages
        logs = [message.log for message in messages]
        shift = end + round(gap * 1e9) - min(logs) if moved else 0
        for message in messages:
            if message.type.endswith(FRAMES):
                if moved:
                    continue
            else:
                message.stamp += shift
            message.log += shift
            together.messages.append(message)
        moved.append(shift * 1e-9)
        end = max(logs) + shift
    together.write(path)
    return moved


def split(file: Path, folder: Path, cuts: tuple[float, ...], stem: str = "my") -> list[Path]:
    """The parts of a recording that was split so many seconds after its start."""
    folder.mkdir(parents=True, exist_ok=True)
    messages = messages_of(file)
    start, parts = messages[0][2].log_time, []
    edges = [-1.0, *cuts, 1e9]
    for number, (low, high) in enumerate(zip(edges, edges[1:], strict=False)):
        within = [m for m in messages if low <= (m[2].log_time - start) * 1e-9 < high]
        parts.append(folder / f"{stem}_{number}.mcap")
        write_again(within, parts[-1])
    return parts
