"""Where the experiment's files lie under data/ and reports/; nothing else spells these paths."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pipeline.params.run import Pair, Recording

ROOT = Path(__file__).parents[1]  # of the checkout that this file is in


@dataclass(frozen=True)
class Layout:
    """The files of a project.

    Attributes:
        root: Of the project; the working folder by default.
    """

    root: Path = Path()

    @property
    def data(self) -> Path:
        return Path(self.root, "data")

    def launches(self, band: str) -> Path:
        """CSV of the launches that were measured of a band."""
        return self.data / "launches" / f"{band}.csv"

    def floor(self, band: str) -> Path:
        """What an oracle's launches of a band miss by on the rig."""
        return self.data / "floor" / f"{band}.json"

    def raw(self, of: Recording) -> Path:
        """Folder of the files of a recording."""
        return self.data / "raw" / of.band / of.recording

    def recorded(self, of: Recording) -> Path:
        """The file that the virtual rig records."""
        return self.raw(of) / f"{of.of_recording}.mcap"

    def files(self, of: Recording) -> list[Path]:
        """All files of a recording, by name, and folders of split bags."""
        folder = self.raw(of)
        split = {part.parent for part in folder.glob("*/*.mcap*") if part.parent.name[0] != "."}
        return sorted({*folder.glob("*.mcap"), *split})

    def episodes(self, of: Recording) -> Path:
        """Folder of the episodes of a recording, a folder for each pull, numbered from 1 on."""
        return self.data / "episodes" / of.band / of.recording

    def episode(self, of: Recording) -> Path:
        """The first of them, which searches of the paper's loss and pictures take."""
        return self.episodes(of) / "1"

    def clamps(self, of: Recording) -> Path:
        """How the band leaves its clamps and bends, as a recording shows."""
        return self.data / "clamps" / of.band / f"{of.recording}.json"

    def card(self, of: Recording) -> Path:
        """Folder of the card of a recording."""
        return self.root / "reports" / "bands" / of.of_recording

    def history(self, pair: Pair) -> Path:
        """What the exploration evaluated."""
        return self.data / "history" / f"{pair.key}.parquet"

    def clusters(self, pair: Pair) -> Path:
        """Regions of the exploration."""
        return self.data / "clusters" / f"{pair.key}.json"

    def evaluations(self, pair: Pair) -> Path:
        """Everything that a search evaluated, its exploration too."""
        return self.data / "evaluations" / f"{pair.key}.parquet"

    def confidence(self, pair: Pair) -> Path:
        """Samples of the posterior, and what a θ file says beside the best evaluation."""
        return self.data / "confidence" / f"{pair.key}.json"

    def theta(self, pair: Pair) -> Path:
        """The best parameters."""
        return self.data / "theta" / f"{pair.key}.json"

    def metrics(self, pair: Pair) -> Path:
        """Its loss and stiffness, for `dvc metrics diff` and `dvc exp show`."""
        return self.root / "reports" / "theta" / f"{pair.key}.json"

    def policy(self, pair: Pair) -> Path:
        """Folder of a policy's files."""
        return self.data / "policies" / pair.key

    def trials(self, pair: Pair) -> Path:
        """Launches, as predicted and as they landed."""
        return self.data / "trials" / f"{pair.key}.parquet"
