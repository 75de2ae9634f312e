"""A band as a folder: what was measured of it, and what was made of that.

    bands/
      lab.yaml          what all bands share: settings that differ from the library's
      orange/
        band.yaml       mass, diameter, rest_length; under `settings` what differs for this band
        recordings/     ROS 2 bags
        launches.csv    measured launches (base/launches_file.py)
        episodes/       made of the recordings, each under a digest of all that made it
        start.json      where the fit begins: by the first recording alone
        theta.json      what was identified, and the digest of all that it rests on
        policy.onnx     and policy.json, where one was trained
        card/           for people: README.md, index.html, pictures; card.json for programs

A person edits band.yaml, lab.yaml and launches.csv; the rest is made by `sling fit`.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Annotated, Any

from pydantic import ValidationError
from ruamel.yaml import YAML

from sling2sim2real.api.model import Band, with_band
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import NotMade, replacing
from sling2sim2real.base.fingerprint import fingerprint
from sling2sim2real.base.launches_file import LaunchRow, read_launches
from sling2sim2real.base.schema import LIST, explained, read_yaml
from sling2sim2real.episode.episode import Episode
from sling2sim2real.recording.files import SUFFIXES, sha256
from sling2sim2real.recording.mask_folder import masks_beside
from sling2sim2real.settings import Settings
from sling2sim2real.settings.lab import BandSizes

BANDS = Path("bands")  # in the working folder
NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")
SIZES = "mass", "diameter", "rest_length"
LIBRARY = Path(__file__).parents[1]
RECORDED = ("setup", "episode", "cloud", "force")  # settings that an episode depends on


class BandFile(BandSizes):
    """What band.yaml holds.

    Attributes:
        assumed: Names of sizes that nobody has measured.
        settings: What differs from the lab's, by section.
    """

    assumed: Annotated[tuple[str, ...], LIST] = ()
    settings: dict[str, Any] = {}

    @property
    def sizes(self) -> dict[str, float]:
        """mass [kg], diameter and rest_length [m]."""
        return {name: getattr(self, name) for name in SIZES}

    def band(self, name: str) -> Band:
        """Raises UserError where no band has such sizes."""
        return Band(**self.sizes, name=name, preconditioned=self.preconditioned)

    def with_sizes(self, given: Mapping[str, float]) -> BandFile:
        """With other sizes, which are not assumed any more."""
        assumed = tuple(name for name in self.assumed if name not in given)
        return self.model_copy(update={**given, "assumed": assumed})

    def save(self, path: Path) -> None:
        """Write it; comments of an earlier one are lost."""
        told = self.model_dump(exclude_defaults=True) | {"settings": self.settings}
        title = "A band by scale, calliper and ruler [kg, m]; settings: what differs from lab.yaml"
        write_yaml(path, plain(told), title)

    @classmethod
    def load(cls, path: Path) -> BandFile:
        """Raises UserError: it cannot be read, or holds what it should not."""
        content = {key: value for key, value in mapping_of(path).items() if value is not None}
        try:
            return cls.model_validate(content)
        except ValidationError as error:
            raise UserError(f"{path}: {explained(error, cls)}") from error


@dataclass(frozen=True)
class BandFolder:
    """The files of one band; `bands/orange`, or a run's `reports/bands/band1`."""

    path: Path

    @classmethod
    def named(cls, name: str) -> BandFolder:
        """The folder of a band in the working folder. Raises UserError where it cannot be one."""
        if not NAME.fullmatch(name):
            raise UserError(
                f"band name {name!r}: use small letters, digits and _, a letter first, at most 40"
            )
        return cls(BANDS / name)

    @classmethod
    def find(cls, path: Path) -> BandFolder | None:
        """The band that a path, or a name in bands/, is the folder of; None of any other path."""
        for place in (path, BANDS / path):
            if (place / "band.yaml").is_file():
                return cls(place)
        return None

    @classmethod
    def at(cls, path: Path) -> BandFolder:
        """As `find`. Raises UserError where there is no band."""
        if folder := cls.find(path):
            return folder
        known = sorted(str(file.parent) for file in BANDS.glob("*/band.yaml"))
        there = f"there are {', '.join(known)}" if known else "`sling fit FILE.mcap` makes one"
        raise UserError(f"{path}: is no folder of a band, with a band.yaml in it; {there}")

    @property
    def name(self) -> str:
        """Of the band: `band1-dips` of reports/bands/band1-dips."""
        return self.path.resolve().name

    @property
    def band_file(self) -> Path:
        return self.path / "band.yaml"

    @property
    def lab_file(self) -> Path:
        return self.path.parent / "lab.yaml"

    @property
    def launches_file(self) -> Path:
        return self.path / "launches.csv"

    @property
    def theta(self) -> Path:
        return self.path / "theta.json"

    @property
    def start(self) -> Path:
        return self.path / "start.json"

    @property
    def card(self) -> Path:
        return self.path / "card"

    @cached_property
    def file(self) -> BandFile:
        """What band.yaml says. Raises UserError."""
        return BandFile.load(self.band_file)

    @property
    def band(self) -> Band:
        return self.file.band(self.name)

    @cached_property
    def settings(self) -> Settings:
        """The library's, with what the lab and the band change. Raises UserError."""
        return self.settings_with(self.file)

    def settings_with(self, file: BandFile) -> Settings:
        """The same for another band.yaml."""
        settings = lab_settings(self.lab_file)
        try:
            settings = settings.changed(**file.settings)
            return with_band(settings, file.band(self.name))
        except (UserError, TypeError) as error:
            raise UserError(f"{self.band_file}: {error}") from error

    @property
    def recordings(self) -> list[Path]:
        """All, by name: files, and folders of split bags."""
        there = sorted((self.path / "recordings").glob("[!.]*"))
        return [
            place
            for place in there
            if (place.is_file() and place.suffix in SUFFIXES)
            or (place.is_dir() and any(part.suffix in SUFFIXES for part in place.iterdir()))
        ]

    @cached_property
    def launches(self) -> list[LaunchRow]:
        """Measured launches, oldest first. Raises UserError."""
        return read_launches(self.launches_file)

    def episodes(self, recording: Path, settings: Settings | None = None) -> Path:
        """Where the episodes of a recording lie, or would: under all that they depend on."""
        settings = settings or self.settings
        sections = settings.bands[self.name], *(getattr(settings, name) for name in RECORDED)
        urdf = [Path("robots", settings.setup.urdf)] if settings.setup.urdf else []
        key = fingerprint(
            _digest_of(recording),
            _code(),
            *(section.model_dump_json() for section in sections),
            *_digests([*urdf, *masks_beside(recording).glob("*.png")]),
        )
        return self.path / "episodes" / key[:16]

    @property
    def first_episode(self) -> Episode | None:
        """That of the first pull, where it is kept."""
        try:
            return Episode.load(self.episodes(self.recordings[0]) / "1")
        except (NotMade, IndexError):
            return None

    @cached_property
    def digest(self) -> str:
        """Of all that θ and the card rest on: recordings, launches, sizes and settings."""
        rows = [repr(vars(row)) for row in self.launches]
        return fingerprint(
            *(self.episodes(recording).name for recording in self.recordings),
            repr((self.file.sizes, self.file.preconditioned, self.file.assumed)),
            self.settings.model_dump_json(),
            *rows,
        )


def lab_settings(path: Path = BANDS / "lab.yaml") -> Settings:
    """The library's settings, with what a lab.yaml changes, if there is one. Raises UserError."""
    return lab_settings_of(mapping_of(path) if path.is_file() else {}, path)


def lab_settings_of(content: Mapping[str, Any], path: Path) -> Settings:
    """The same by what such a file holds, or is to hold."""
    try:
        return Settings.default(**content)
    except (UserError, TypeError) as error:  # or a key that is no text
        raise UserError(f"{path}: {str(error).removeprefix('settings: ')}") from error


def differences(settings: Settings, base: Settings) -> dict[str, Any]:
    """What `settings` has other than `base`, by section, as band.yaml and lab.yaml hold it."""

    def differing(one: Mapping, other: Mapping) -> dict:
        found = {}
        for key, value in one.items():
            there = other.get(key)
            if isinstance(value, Mapping) and isinstance(there, Mapping) and there:
                value = differing(value, there)
                if not value:
                    continue
            elif value == there:
                continue
            found[key] = plain(value)
        return found

    return differing(settings.model_dump(), base.model_dump())


def mapping_of(path: Path) -> dict[str, Any]:
    """The mapping that a YAML file holds; of an empty one, nothing. Raises UserError."""
    content = read_yaml(path)
    if content is not None and not isinstance(content, dict):
        raise UserError(f"{path}: must hold a mapping, such as `setup:`")
    return content or {}


def write_yaml(path: Path, content: Mapping[str, Any], title: str) -> None:
    """Write a mapping below a comment; whole or not at all."""
    yaml = YAML()
    yaml.default_flow_style = None  # lists on one line
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8") as file:
        file.write(f"# {title}.\n")
        yaml.dump(content, file)


def plain(value: Any) -> Any:
    """Tuples as lists, at any depth: YAML has no others."""
    if isinstance(value, Mapping):
        return {key: plain(part) for key, part in value.items()}
    return [plain(part) for part in value] if isinstance(value, list | tuple) else value


@cache
def _digest_of(recording: Path) -> str:
    return sha256(recording)  # of hundreds of megabytes


@cache
def _code() -> str:
    """Of what makes episodes."""
    return fingerprint(*(LIBRARY / name for name in ("base", "episode", "recording")))


def _digests(files: Sequence[Path]) -> list[str]:
    return [
        f"{file.name} {hashlib.sha256(file.read_bytes()).hexdigest()}"
        for file in sorted(files)
        if file.is_file()
    ]
