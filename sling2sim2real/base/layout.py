"""Where files lie under data/, and the error of one that is not there, or not whole.

No other module of pipeline/ spells these paths. What makes a file is said where errors are printed
(stages/start.py), by its place alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from sling2sim2real.base.errors import UserError

OF_A_BAND = ("raw", "episodes", "clamps", "launches", "floor")
OF_A_METHOD = (
    "history", "clusters", "evaluations", "confidence", "theta", "policies", "trials"
)  # fmt: skip


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

    @property
    def measured(self) -> Path:
        """Folder of the launches that a user measured, a CSV a band."""
        return self.data / "trials" / "measured"

    @property
    def evidence(self) -> Path:
        """Folder of the launches that are evidence, a CSV a band."""
        return self.data / "evidence"

    def raw(self, band: str) -> Path:
        """Folder of a band's recordings."""
        return self.data / "raw" / band

    def recording(self, band: str) -> Path:
        """The file that the virtual rig records."""
        return self.raw(band) / f"{band}.mcap"

    def recordings(self, band: str) -> list[Path]:
        """All recordings of a band, by name: files, and folders of split bags."""
        folder = self.raw(band)
        split = {part.parent for part in folder.glob("*/*.mcap*") if part.parent.name[0] != "."}
        return sorted({*folder.glob("*.mcap"), *split})

    def episodes(self, band: str) -> Path:
        """Folder of a band's episodes, a folder for each of its recorded pulls."""
        return self.data / "episodes" / band

    def episode(self, band: str, number: int = 1) -> Path:
        """Folder of signals.parquet and clouds.parquet of one pull, numbered from 1 on."""
        return self.episodes(band) / str(number)

    def clamps(self, band: str) -> Path:
        """How the band leaves its clamps and bends, as its recording shows."""
        return self.data / "clamps" / f"{band}.json"

    def observed(self, band: str) -> Path:
        """The band's launches that are evidence, checked, from its CSV in `evidence`."""
        return self.data / "launches" / band / "observed.json"

    def scores(self, band: str) -> Path:
        """The band's launches that score predictions, checked, from its CSV in `measured`."""
        return self.data / "launches" / band / "scores.json"

    def floor(self, band: str) -> Path:
        return self.data / "floor" / f"{band}.json"

    def plans(self, band: str) -> Path:
        """Folder of what a robot is to do."""
        return self.data / "plans" / band

    def history(self, band: str, method: str) -> Path:
        return self.data / "history" / band / f"{method}.parquet"

    def clusters(self, band: str, method: str) -> Path:
        return self.data / "clusters" / band / f"{method}.json"

    def evaluations(self, band: str, method: str) -> Path:
        """Everything that a search evaluated, its exploration too."""
        return self.data / "evaluations" / band / f"{method}.parquet"

    def theta(self, band: str, method: str) -> Path:
        return self.data / "theta" / band / f"{method}.json"

    def confidence(self, band: str, method: str) -> Path:
        """Samples of the posterior, and what a θ file says beside the best evaluation."""
        return self.data / "confidence" / band / f"{method}.json"

    def policy(self, band: str, method: str) -> Path:
        """Folder of a policy's files."""
        return self.data / "policies" / band / method

    def card(self, band: str) -> Path:
        """Folder of a band's card."""
        return self.root / "reports" / "bands" / band

    def launches(self, band: str, method: str) -> Path:
        """What the rig's launches with the policy led to."""
        return self.policy(band, method) / "launches.parquet"

    def trials(self, band: str, method: str) -> Path:
        return self.data / "trials" / band / f"{method}.parquet"


def owner(path: Path) -> tuple[str, str, str | None] | None:
    """Folder under data/, band and method (None: of the band alone) of a file that a run makes.

    None for any other file.
    """
    parts = Path(path).parts
    if "data" not in parts:
        return None
    place = len(parts) - parts[::-1].index("data")
    folder, band, method = (*parts[place : place + 3], "", "", "")[:3]
    if folder in OF_A_BAND and band:
        return folder, band.partition(".")[0], None
    if folder in OF_A_METHOD and method and band != "measured":
        return folder, band, method.partition(".")[0]
    return None


class NotMade(UserError):
    """A file that a run makes is missing, or not as the run has left it.

    Attributes:
        path: Of the file.
        problem: What is wrong with it.
    """

    def __init__(self, path: Path, problem: str = "missing") -> None:
        super().__init__(path, problem)
        self.path, self.problem = Path(path), problem

    def __str__(self) -> str:
        return f"{self.path}: {self.problem}"


def made(path: Path) -> Path:
    """`path`, which must be a file. Raises NotMade."""
    if not path.is_file():
        raise NotMade(path)
    return path
