"""A check, and what it finds in a recording."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Check:
    """A row of the table of checks.

    Attributes:
        name: By which programs know it.
        compares: What is compared with what.
        uncertainty: Of the comparison, and where it comes from.
        warns: From when on a finding costs accuracy.
        refuses: From when on the recording cannot be used; "" where it always can.
        remedy: What to do about it.
    """

    name: str
    compares: str
    uncertainty: str
    warns: str
    refuses: str
    remedy: str

    def found(self, what: str, cure: str | None = None, refused: bool = False) -> Finding:
        """What it found; the cure is its remedy where no other one is given."""
        return Finding(self.name, what, self.remedy if cure is None else cure, refused)


@dataclass(frozen=True)
class Finding:
    """What a check found.

    Attributes:
        about: The check's name.
        what: With the numbers of this recording.
        cure: What to do about it; "" where `what` says it.
        refused: The recording cannot be used.
    """

    about: str
    what: str
    cure: str
    refused: bool = False

    def __str__(self) -> str:
        return f"{self.what}: {self.cure}" if self.cure else self.what

    def content(self) -> dict[str, str]:
        """Return the finding's texts for an episode's metadata."""
        return {"about": self.about, "what": self.what, "cure": self.cure}
