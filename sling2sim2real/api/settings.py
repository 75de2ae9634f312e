"""Settings: what params.yaml holds, as an object that needs no file in the working folder."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.resources import as_file, files
from pathlib import Path
from typing import Self

from pydantic import ValidationError

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.schema import explained
from sling2sim2real.settings import Params, load

COARSE = {
    "sling": {
        "edges": 16,
        "grip_step": 0.01,
        "recoil_step": 5e-4,
        "swing_step": 2e-3,
        "launch_step": 5e-4,
    },
    "optimizer": {"population": 16, "generations": 1, "k_nn": 15},
    "policy": {"map_size": [9, 7]},
}

# what a params.yaml must name; longer than any fork is wide, for functions are given their band
RECORDING = {"band": "band", "recording": "plain"}
PAIR = {"band-posterior": RECORDING | {"method": "posterior"}}
NO_RUN = {"floors": [], "main": "posterior", "rig": {}, "recordings": {"band": RECORDING}}
NO_RUN |= {"multistart": {}, "search": {}} | dict.fromkeys(("posterior", "explored", "pairs"), PAIR)
NO_BAND = {"source": "recording", "mass": 1.0, "diameter": 0.01, "rest_length": 3.0}


class Settings(Params):
    """Everything that a result depends on beside the data: sections and keys are params.yaml's.

    Bands are not among them: functions are given theirs. SI units; params.yaml says what each key
    means. Frozen; `changed` gives another one. A wrong key or value is a UserError of one line that
    names it.

    >>> from sling2sim2real import Settings
    >>> settings = Settings.default(setup={"fork_width": 0.30})
    >>> settings.setup.fork_width, settings.setup.fork_height
    (0.3, 0.52)
    >>> settings.changed(setup={"fork_widht": 0.30})
    Traceback (most recent call last):
    ...
    sling2sim2real.base.errors.UserError: settings: setup.fork_widht: unknown key, ...
    """

    @classmethod
    def default(cls, **changes: Mapping) -> Self:
        """The project's own params.yaml, which comes with the package, with `changes` as there.

        >>> Settings.default(sling={"edges": 48}).sling.edges
        48
        """
        return cls._checked(_merged(_defaults(), changes))

    @classmethod
    def coarse(cls, **changes: Mapping) -> Self:
        """The same for first tries and tests: coarser simulations, a smaller search and map.

        Landings move by about a centimetre; do not publish what it gives.

        >>> Settings.coarse().sling.edges
        16
        """
        return cls.default(**_merged(COARSE, changes))

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """A params.yaml of your own, which must be whole.

        Raises:
            UserError: It cannot be read, or a key is wrong.
        """
        return cls._checked(load(path).model_dump())

    def changed(self, **changes: Mapping) -> Self:
        """These settings with other values: `settings.changed(force={"cutoff": 0.1})`.

        >>> Settings.default().changed(trials={"actuation_error": 0.0}).trials.actuation_error
        0.0
        """
        return self._checked(_merged(self.model_dump(), changes))

    @classmethod
    def _checked(cls, content: Mapping) -> Self:
        try:
            return cls.model_validate(content)
        except ValidationError as error:
            raise UserError(f"settings: {explained(error, cls)}") from error


@cache
def _defaults() -> dict:
    with as_file(files("sling2sim2real") / "params.yaml") as path:
        content = load(path).model_dump()
    content["bands"] = {"band": NO_BAND}
    content["run"] = NO_RUN
    return content


def _merged(old: Mapping, changes: Mapping) -> dict:
    """Mappings key by key, at any depth; what is new wins."""
    merged = dict(old)
    for key, value in changes.items():
        both = isinstance(value, Mapping) and isinstance(merged.get(key), Mapping)
        merged[key] = _merged(merged[key], value) if both else value
    return merged
