"""What params.yaml says to run: recordings of bands, and pairs of a recording and a method."""

from __future__ import annotations

from typing import Annotated

from pydantic import model_validator

from sling2sim2real.base.schema import FILLED, LIST, Name, Names, Range, Section, refusal
from sling2sim2real.settings.launches import Nodes

PLAIN = "plain"  # the recording that gives its band's name to its stages
UNIONS = {"explored": ("multistart", "posterior"), "pairs": ("multistart", "posterior", "search")}


class Recording(Section):
    """Pulls of a band, in files of one folder: data/raw/<band>/<recording>/."""

    band: Name
    recording: Name

    @property
    def of_recording(self) -> str:
        """What its stages are called by: `band1`, or `band1-dips`."""
        return self.band if self.recording == PLAIN else f"{self.band}-{self.recording}"

    @property
    def key(self) -> str:
        """What its stages and files are called by."""
        return self.of_recording


class Pair(Recording):
    """A method on a recording.

    Attributes:
        search: Whose code the stage `search` lists; None where it is not in the pair's chain.
    """

    method: Name
    search: Name | None = None

    @property
    def key(self) -> str:
        return f"{self.of_recording}-{self.method}"


class RunParams(Section):
    """Each entry of a mapping has its stages; dvc.yaml cannot look one up in another."""

    floors: Names
    main: Name
    rig: dict[str, Recording]
    recordings: Annotated[dict[str, Recording], FILLED]
    multistart: dict[str, Pair]
    posterior: dict[str, Pair]
    search: dict[str, Pair]
    explored: dict[str, Pair]
    pairs: dict[str, Pair]

    @property
    def first(self) -> dict[str, Recording]:
        """Each band's first recording, which is the band's in tables and pictures."""
        first: dict[str, Recording] = {}
        for recording in self.recordings.values():
            first.setdefault(recording.band, recording)
        return first

    @model_validator(mode="after")
    def _entries_are_called_by_what_they_are(self) -> RunParams:
        for kind in ("rig", "recordings", *UNIONS["pairs"]):
            for name, entry in getattr(self, kind).items():
                if name != entry.key:
                    raise refusal(f"{kind}.{name}: must be called {entry.key}, by what it is of")
        return self

    @model_validator(mode="after")
    def _unions_follow(self) -> RunParams:
        for union, kinds in UNIONS.items():
            whole = {key: pair for kind in kinds for key, pair in getattr(self, kind).items()}
            if getattr(self, union) != whole:
                merge = ", ".join(f"*{kind}" for kind in kinds)
                raise refusal(f"{union}: must be {{<<: [{merge}]}}: {' and '.join(kinds)}")
        if not self.rig.items() <= self.recordings.items():
            raise refusal("recordings: must hold `rig`: {<<: *rig}")
        return self

    @model_validator(mode="after")
    def _pairs_have_recordings_and_recordings_a_card(self) -> RunParams:
        for key, pair in self.pairs.items():
            if pair.of_recording not in self.recordings:
                raise refusal(f"recordings: lacks {pair.of_recording}, on which {key} is to run")
        for key in self.recordings:
            if f"{key}-{self.main}" not in self.pairs:
                raise refusal(
                    f"pairs: lacks {key}-{self.main}: the card of a recording is by `main`"
                )
        return self


class FloorParams(Section):
    """How far launches of an oracle policy miss: what no method can help."""

    map_size: Annotated[tuple[Nodes, Nodes], LIST]
    launches: Annotated[int, Range(0, 10_000)]  # a target, beside those with the trials' errors
