"""What models of params.yaml and of JSON files are made of: ranges, names, vectors, and violations
in one line.
"""

from __future__ import annotations

import json
import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, TypeVar, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    ValidationError,
    ValidatorFunctionWrapHandler,
)
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from sling2sim2real.base.errors import UserError, one_line
from sling2sim2real.base.files import NotMade


class Section(BaseModel):
    """A mapping of params.yaml. Integers pass for floats; nothing else is converted."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, defer_build=True)


class JsonRecord(Section):
    """A mapping of a JSON file, which may hold more than is read."""

    model_config = ConfigDict(extra="allow", allow_inf_nan=False)


Read = TypeVar("Read", bound=JsonRecord)


def read_json(path: Path, model: type[Read]) -> Read:
    """A JSON file by its model. Raises NotMade: missing, no JSON, or not as the model wants it."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise NotMade(path) from error
    except (OSError, ValueError, RecursionError) as error:
        why = getattr(error, "strerror", None) or one_line(error)
        raise NotMade(path, f"cannot be read as JSON ({why})") from error
    try:
        return model.model_validate(content)
    except ValidationError as error:
        raise NotMade(path, explained(error, model)) from error


def read_yaml(path: Path) -> Any:
    """What a YAML file holds. Raises UserError."""
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise UserError(f"{path}: no such file") from error
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not UTF-8 text"
        raise UserError(f"{path}: cannot be read ({reason})") from error
    return parse_yaml(text, str(path))


def parse_yaml(text: str, name: str) -> Any:
    """What a YAML text holds; `name` stands in error messages. Raises UserError."""
    from ruamel.yaml import YAML, YAMLError  # the parser that DVC uses

    try:
        return YAML(typ="safe").load(text)
    except (YAMLError, ValueError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        where = f", line {mark.line + 1}" if mark else ""
        what = getattr(error, "problem", None) or str(error).partition("\n")[0]
        raise UserError(f"{name}{where}: not valid YAML ({what})") from error


def refusal(message: str) -> PydanticCustomError:
    """The error by which a validator refuses a value; `message` follows the key's path."""
    return PydanticCustomError("refused", "{message}", {"message": message})


@dataclass(frozen=True)
class Range:
    """Closed range of a number; refuses NaN and infinity too."""

    low: float
    high: float

    def __get_pydantic_core_schema__(
        self, source: type, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        limits = f"between {self.low:.10g} and {self.high:.10g}"

        def check(value: object, validate: ValidatorFunctionWrapHandler) -> float:
            try:
                number = validate(value)
            except ValidationError:
                kind = "whole number" if source is int else "number"
                hint = " (no quotes around numbers)" if isinstance(value, str) else ""
                raise refusal(f"must be a {kind} {limits}, got {_shown(value)}{hint}") from None
            if not self.low <= number <= self.high:
                raise refusal(f"must be {limits}, got {_shown(value)}")
            return number

        return core_schema.no_info_wrap_validator_function(check, handler(source))


def _is_name(text: str) -> str:
    if not (text.isascii() and text.isidentifier() and len(text) <= 40):
        raise refusal(
            f"a name has at most 40 letters, digits and _, no digit first: {_shown(text)}"
        )
    return text


def _is_folder(text: str) -> str:
    _is_name(text.replace("-", "_"))
    return text


def _is_ascending(pair: tuple[float, float]) -> tuple[float, float]:
    if not pair[0] < pair[1]:
        raise refusal(f"the first must be less than the second, got {list(pair)}")
    return pair


def _has_unit_length(vector: tuple[float, ...]) -> tuple[float, ...]:
    """A direction, or the quaternion at the end of a pose."""
    if abs(math.hypot(*vector[-4:]) - 1.0) > 1e-3:
        what = "quaternion" if len(vector) == 7 else "vector"
        raise refusal(f"the {what} must have length 1, got {list(vector[-4:])}")
    return vector


def _has_no_twins(items: tuple[Hashable, ...]) -> tuple[Hashable, ...]:
    if len(set(items)) < len(items):
        raise refusal(f"lists an entry twice: {list(items)}")
    return items


LIST = Field(strict=False)  # YAML has lists where the models keep tuples
FILLED = Field(min_length=1)
ASCENDING = AfterValidator(_is_ascending)
UNIQUE = AfterValidator(_has_no_twins)
UNIT = AfterValidator(_has_unit_length)

Name = Annotated[str, AfterValidator(_is_name)]
FolderName = Annotated[str, AfterValidator(_is_folder)]  # such as band1-dips
Names = Annotated[tuple[Name, ...], LIST, UNIQUE]
Seed = Annotated[int, Range(0, 2**31 - 1)]
Metres = Annotated[float, Range(-10, 10)]
Component = Annotated[float, Range(-1, 1)]
Direction = Annotated[tuple[Component, Component, Component], LIST, UNIT]
Pose = Annotated[  # x, y, z and the quaternion qx, qy, qz, qw
    tuple[Metres, Metres, Metres, Component, Component, Component, Component], LIST, UNIT
]


def explained(error: ValidationError, model: type[Section]) -> str:
    """The first violation in words; a misspelt key comes before the key that it leaves missing."""
    errors = error.errors(include_url=False)
    first = min(errors, key=lambda error_entry: error_entry["type"] != "extra_forbidden")
    kind, got = first["type"], _shown(first.get("input"))
    path = [str(part) for part in first["loc"] if part != "[key]"]
    if kind == "extra_forbidden":
        message = f"unknown key, the closest known one is {_closest(first['loc'], model)}"
    elif kind == "missing":
        message = "is missing"
    elif kind == "refused":
        message = first["msg"]
    elif kind in ("tuple_type", "model_type", "dict_type"):
        message = f"must be a {'list' if kind == 'tuple_type' else 'mapping'}, got {got}"
    elif kind == "too_short":
        message = "must not be empty"
    else:
        message = f"{first['msg'].replace('Input should', 'must')}, got {got}"
    return one_line(": ".join(filter(None, (".".join(path), message))))


def _shown(value: object) -> str:
    try:
        text = repr(value)
    except ValueError:  # Python prints no integer of thousands of digits
        text = "an enormous number"
    return text if len(text) <= 60 else f"{text[:57]}..."


def _closest(path: Sequence[str | int], model: type[Section]) -> str:
    """The known key that is most like the unknown one at the end of `path`."""
    import difflib  # for a mistake alone

    kind: Any = model
    for part in path[:-1]:
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            kind = kind.model_fields[str(part)].annotation
        else:  # a list, or a mapping
            kind = [argument for argument in get_args(kind) if argument is not Ellipsis][-1]
        if isinstance(kind, UnionType):  # a section, or null
            kind = get_args(kind)[0]
    return difflib.get_close_matches(str(path[-1]), list(kind.model_fields), n=1, cutoff=0)[0]
