"""The file: whether all of it is there, and whether damage would be noticed."""

from __future__ import annotations

from collections.abc import Iterator

from sling2sim2real.recording.checks.finding import Check, Finding
from sling2sim2real.recording.processed import Processed

CHECKSUMS = Check(
    "checksums",
    "the file's chunks with their checksums",
    "none: a checksum fits or not",
    "the file has none, so that damage to its messages would not be noticed",
    "",
    "let the recorder write chunk CRCs, its default",
)
LOSSES = Check(
    "losses",
    "what the file holds with what can be read",
    "none: a message can be read or not",
    "anything was lost or mended",
    "no pull is left that can be used",
    "see whether it touches the pull; copy the file again, or record again",
)
CHECKS = (CHECKSUMS, LOSSES)


def findings(done: Processed) -> Iterator[Finding]:
    recording = done.pull.recording
    for note in recording.notes:
        if "no checksums" in note:
            yield CHECKSUMS.found(note)
    if recording.losses:
        count = len(recording.losses)
        many = f"{count} things were lost or mended, first of all"
        yield LOSSES.found(f"{many if count > 1 else 'lost or mended'}: {recording.losses[0]}")
