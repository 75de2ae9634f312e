"""Settings: everything that a result depends on beside the data, with its default."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar, Self

from pydantic import Field, ValidationError, model_validator

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.schema import (
    FolderName,
    Name,
    Section,
    explained,
    parse_yaml,
    read_yaml,
    refusal,
)
from sling2sim2real.base.target import TARGET_AREA
from sling2sim2real.settings.identification import (
    LossParams,
    MethodDefaults,
    MethodParams,
    OptimizerParams,
    ParameterBoxes,
    SlingParams,
    check_method,
    default_methods,
)
from sling2sim2real.settings.lab import BandParams, PlanParams, SetupParams
from sling2sim2real.settings.launches import LaunchParams, PolicyParams, TrialsParams
from sling2sim2real.settings.recording import CloudParams, EpisodeParams, ForceParams

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


class Settings(Section):
    """Everything that a result depends on beside the data: sections and keys are params.yaml's.

    Bands are not among them: functions are given theirs. SI units; params.yaml says what each key
    means. Frozen; `changed` gives another one. A wrong key or value is a UserError of one line that
    names it. Defaults are made when they are asked for: a stage has all of its file.

    >>> from sling2sim2real import Settings
    >>> settings = Settings.default(setup={"fork_width": 0.30})
    >>> settings.setup.fork_width, settings.setup.fork_height
    (0.3, 0.52)
    >>> settings.changed(setup={"fork_widht": 0.30})
    Traceback (most recent call last):
    ...
    sling2sim2real.base.errors.UserError: settings: setup.fork_widht: unknown key, ...
    """

    passed_over: ClassVar[tuple[str, ...]] = ("run", "floor", "rig")  # of an experiment's file

    setup: SetupParams = Field(default_factory=SetupParams)
    plan: PlanParams = Field(default_factory=PlanParams)
    episode: EpisodeParams = Field(default_factory=EpisodeParams)
    force: ForceParams = Field(default_factory=ForceParams)
    cloud: CloudParams = Field(default_factory=CloudParams)
    sling: SlingParams = Field(default_factory=SlingParams)
    parameters: ParameterBoxes = Field(default_factory=ParameterBoxes)
    loss: LossParams = Field(default_factory=LossParams)
    optimizer: OptimizerParams = Field(default_factory=OptimizerParams)
    method_defaults: MethodDefaults = Field(default_factory=MethodDefaults)
    methods: dict[Name, MethodParams] = Field(default_factory=default_methods)
    policy: PolicyParams = Field(default_factory=PolicyParams)
    launch: LaunchParams = Field(default_factory=LaunchParams)
    trials: TrialsParams = Field(default_factory=TrialsParams)
    bands: dict[FolderName, BandParams] = {}

    @classmethod
    def default(cls, **changes: Mapping) -> Self:
        """The defaults, with `changes`.

        >>> Settings.default(sling={"edges": 48}).sling.edges
        48
        """
        return cls.checked(changes)

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
        """Settings of a YAML file; what it leaves out is the default.

        It may be an experiment's params.yaml, whose other sections are passed over.

        Raises:
            UserError: It cannot be read, or a key is wrong.
        """
        return cls._of_file(read_yaml(Path(path)), str(path))

    @classmethod
    def parse(cls, text: str, name: str = "params.yaml") -> Self:
        """Settings of a YAML text; `name` stands in error messages. Raises UserError."""
        return cls._of_file(parse_yaml(text, name), name)

    @classmethod
    def _of_file(cls, content: object, name: str) -> Self:
        if isinstance(content, Mapping):
            content = {key: it for key, it in content.items() if key not in cls.passed_over}
        return cls.checked(content, name)

    @classmethod
    def checked(cls, content: object, name: str = "settings") -> Self:
        """Settings of sections and keys; `name` stands in error messages. Raises UserError."""
        if not isinstance(content, Mapping):
            raise UserError(f"{name}: must hold a mapping of sections such as `setup:`")
        try:
            return cls.model_validate(content)
        except ValidationError as error:
            raise UserError(f"{name}: {explained(error, cls)}") from error

    def changed(self, **changes: Mapping) -> Self:
        """These settings with other values: `settings.changed(force={"cutoff": 0.1})`.

        >>> Settings.default().changed(trials={"actuation_error": 0.0}).trials.actuation_error
        0.0
        """
        return self.checked(_merged(self.model_dump(), changes))

    @model_validator(mode="before")
    @classmethod
    def _methods_are_whole(cls, content: object) -> object:
        """A method's own keys win; what it leaves out is as `method_defaults` says."""
        if not isinstance(content, dict):
            return content
        defaults, methods = content.get("method_defaults"), content.get("methods")
        if not (isinstance(defaults, dict) and isinstance(methods, dict)):
            return content
        whole = {
            name: {**defaults, **method} if isinstance(method, dict) else method
            for name, method in methods.items()
        }
        return content | {"methods": whole}

    @model_validator(mode="after")
    def _sections_fit(self) -> Settings:
        for name, method in self.methods.items():
            check_method(method, f"methods.{name}.", self.parameters, self.optimizer)
        if self.setup.foot_height >= self.setup.fork_height:
            raise refusal("setup.foot_height: must be less than setup.fork_height")
        if self.setup.draw_z[0] <= -self.setup.fork_height:
            raise refusal("setup.draw_z: must be above the floor, setup.fork_height below the tips")
        for name, band in self.bands.items():
            if band.rest_length <= self.setup.fork_width:
                raise refusal(
                    f"bands.{name}.rest_length: {band.rest_length:g} must be longer than"
                    f" setup.fork_width, {self.setup.fork_width:g}"
                )
        return self

    @model_validator(mode="after")
    def _trials_are_trained(self) -> Settings:
        low, high = self.policy.targets
        for target in self.trials.targets:
            if not low <= target <= high:
                raise refusal(
                    f"trials.targets: {target} lies outside policy.targets [{low}, {high}]"
                )
            if not TARGET_AREA[0] <= target <= TARGET_AREA[1]:
                raise refusal(
                    f"trials.targets: {target} lies outside the target on the floor,"
                    f" {list(TARGET_AREA)}, where every landing counts as failed"
                )
        return self


def _merged(old: Mapping, changes: Mapping) -> dict:
    """Mappings key by key, at any depth; what is new wins."""
    merged = dict(old)
    for key, value in changes.items():
        both = isinstance(value, Mapping) and isinstance(merged.get(key), Mapping)
        merged[key] = _merged(merged[key], value) if both else value
    return merged


def expect_known(settings: Settings, kind: str, name: str, called: str | None = None) -> None:
    """Raises UserError where there is no such `kind`, band or method; `called` names it."""
    defined = getattr(settings, f"{kind}s")
    if name not in defined:
        raise UserError(
            f"{called or kind} {name}: not in params.yaml, which has {', '.join(defined)}"
        )
