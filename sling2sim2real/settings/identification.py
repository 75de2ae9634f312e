"""What params.yaml says of the simulator, the loss and the search."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any, ClassVar, Literal, get_args

from pydantic import (
    AfterValidator,
    Field,
    ValidationInfo,
    create_model,
    field_validator,
    model_validator,
)

from sling2sim2real.base.imported import is_import
from sling2sim2real.base.parameters import THETA, Parameter, added_by, parameters
from sling2sim2real.base.schema import ASCENDING, LIST, Range, Section, Seed, refusal

Step = Annotated[float, Range(1e-5, 0.05)]
KTop = Annotated[int, Range(1, 50)]
Law = Literal["neo_hookean", "rubber", "corotated"]  # of the band's material
# What each has beside the parameters of every law, and how far its box may reach.
LAWS = {law: added_by(law) for law in get_args(Law)}
POSTERIOR, PAPER = "posterior", "paper"
UNSEEN = tuple(  # what a pull does not show
    row.name for row in parameters("neo_hookean") if row.coordinate is None
)
_FOLDER = "sling2sim2real.identification.searches"
SEARCHES = {  # what the rows of each are called, and its function
    "multistart": ("de", f"{_FOLDER}.de:differential_evolution"),
    POSTERIOR: ("design", "sling2sim2real.identification.search:design"),
    "de": ("de", f"{_FOLDER}.de:differential_evolution"),
    "bo": ("bo", f"{_FOLDER}.bo:bayesian"),
    "adam": ("adam", f"{_FOLDER}.adam:adam"),
}
OWN = "own"  # any other: a function of the user's
OUR_ENGINE = "sling"
ENGINES = {  # what simulates
    OUR_ENGINE: "sling2sim2real.identification.objective.evaluate:simulated",
    "physx": "sling2sim2real.engines.physx.rollouts:simulate",
}


class SlingParams(Section):
    edges: Annotated[int, Range(4, 400)] = 24
    grading: Annotated[float, Range(1, 20)] = 8.0
    grip_step: Step = 0.005
    hold_step: Step = 0.02
    recoil_step: Step = 0.00025
    recoil_time: Annotated[float, Range(1e-3, 10)] = 0.1
    swing_step: Step = 0.001
    launch_step: Step = 0.00025
    launch_time: Annotated[float, Range(0.01, 10)] = 0.5

    @model_validator(mode="after")
    def _middle_is_a_layer(self) -> SlingParams:
        if self.edges % 2:
            raise refusal("edges must be even: the hand holds the middle")
        return self


class Box(Section):
    """One axis of the search."""

    scale: ClassVar[str]  # linear or log, as the table says
    low: float
    high: float

    @model_validator(mode="after")
    def _low_below_high(self) -> Box:
        if not self.low < self.high:
            raise refusal("low must be less than high")
        return self


def _axis(row: Parameter) -> Any:
    bound = Annotated[float, Range(*row.reach)]
    kind = create_model(row.name, __base__=Box, low=bound, high=bound)
    kind.scale = row.scale
    low, high = row.box
    return kind, Field(default_factory=partial(kind, low=low, high=high))


_BOXES = {row.name: _axis(row) for row in parameters("neo_hookean") if row.name in THETA}


class ParameterBoxes(create_model("_ParameterBoxes", __base__=Section, **_BOXES)):
    """The box of each of THETA."""


class LossParams(Section):
    chamfer: Literal["symmetric", "clouds"] = "clouds"
    median_window: Annotated[int, Range(1, 101)] = 7

    @model_validator(mode="after")
    def _window_has_a_middle(self) -> LossParams:
        if self.median_window % 2 == 0:
            raise refusal("median_window must be odd")
        return self


Factor = Annotated[float, Range(0, 1.99)]  # SciPy's differential evolution wants less than 2


class OptimizerParams(Section):
    seed: Seed = 1
    population: Annotated[int, Range(5, 100_000)] = 20
    generations: Annotated[int, Range(1, 100_000)] = 8
    mutation: Annotated[tuple[Factor, Factor], LIST, ASCENDING] = (0.5, 1.0)
    recombination: Annotated[float, Range(0, 1)] = 0.7
    k_top: KTop = 5
    k_nn: Annotated[int, Range(6, 10_000)] = 15  # a covariance of five parameters needs six points
    delta: Annotated[float, Range(1e-3, 2)] = 0.1
    cma_population: Annotated[int, Range(4, 10_000)] = 8
    cma_rollouts: Annotated[int, Range(4, 10_000_000)] = 420

    @model_validator(mode="after")
    def _budgets_suffice(self) -> OptimizerParams:
        explored = self.population * (self.generations + 1)
        if self.k_nn > explored:
            raise refusal(f"k_nn must be at most population x (generations + 1) = {explored}")
        iteration = self.k_top * self.cma_population
        if self.cma_rollouts < iteration:
            raise refusal(f"cma_rollouts must be at least k_top x cma_population = {iteration}")
        return self


Weight = Annotated[float, Range(0, 1e6)]


class Weights(Section):
    geom: Weight = 1.0
    force: Weight = 1.0
    work: Weight = 1.0

    @model_validator(mode="after")
    def _something_counts(self) -> Weights:
        if not any((self.geom, self.force, self.work)):
            raise refusal("at least one weight must be above 0")
        return self


def _one_of(ours: tuple[str, ...], kind: str) -> AfterValidator:
    """One of ours, or a `kind` of the user's by its place."""

    def check(text: str) -> str:
        if text not in ours and not is_import(text):
            raise refusal(f"must be {', '.join(ours)} or package.module:{kind}, got {text!r}")
        return text

    return AfterValidator(check)


def _is_setting(value: object) -> object:
    if not isinstance(value, bool | int | float | str):
        raise refusal(f"must be a number, true, false or a text, got {repr(value)[:60]}")
    return value


Value = Annotated[float, Range(-1e9, 1e9)]
Setting = Annotated[object, AfterValidator(_is_setting)]
Bounds = Annotated[tuple[Value, Value], LIST]


class MethodDefaults(Section):
    """Keys that a method may leave out; what they mean stands beside them in params.yaml."""

    law: Law = "corotated"
    search: Annotated[str, _one_of((*SEARCHES,), "function")] = "multistart"
    engine: Annotated[str, _one_of((*ENGINES,), "function")] = "sling"
    settings: dict[str, Setting] = {}
    fixed: dict[str, Value] = {}
    bounds: dict[str, Bounds] = {}
    k_top: KTop | None = None
    mounting: bool = True
    covariance: bool = True
    weights: Weights = Field(default_factory=Weights)


class MethodParams(MethodDefaults):
    """What is weighed, what is searched, and how."""

    bounds: dict[str, Bounds] = Field(default={}, validate_default=True)

    @field_validator("bounds")
    @classmethod
    def _law_has_its_box(cls, bounds: dict[str, Bounds], given: ValidationInfo) -> dict:
        """What a law adds is searched within the table's box, unless the method says another."""
        added = [row for row in parameters(given.data.get("law", "")) if row.law]
        fixed = given.data.get("fixed", {})
        return {row.name: row.box for row in added if row.name not in fixed} | bounds

    @model_validator(mode="after")
    def _keys_belong_to_the_search(self) -> MethodParams:
        given = {"rollouts", "seed", "population"} & {*self.settings}
        if given:
            raise refusal(f"settings: {min(given)} stands under `optimizer`, for all methods")
        if self.search == "multistart" and self.settings:
            raise refusal("settings are for another search than multistart, which has none")
        if self.search != "multistart" and not (self.k_top is None and self.covariance):
            raise refusal(f"k_top and covariance are for search: multistart, not {self.search}")
        return self

    @model_validator(mode="after")
    def _posterior_fixes_the_unseen(self) -> MethodParams:
        if self.search != POSTERIOR:
            return self
        more = {*self.fixed} - {*UNSEEN}
        if not (more <= {*LAWS[self.law]} and {*UNSEEN} <= {*self.fixed}):
            raise refusal(
                f"search: {POSTERIOR} wants `fixed` to name {', '.join(UNSEEN)}, which no pull"
                " shows, and besides them no more than what its law adds"
            )
        if self.settings:
            raise refusal(f"settings: {POSTERIOR} has none")
        if self.engine != OUR_ENGINE:
            raise refusal(f"search: {POSTERIOR} wants engine: {OUR_ENGINE}")
        return self


def default_methods() -> dict[str, MethodParams]:
    """The paper's; and ours, the mode of one density over all recordings and launches."""
    fixed = {row.name: row.fixed for row in parameters("rubber") if row.fixed is not None}
    ours = MethodParams(search=POSTERIOR, law="rubber", fixed=fixed)
    return {PAPER: MethodParams(), POSTERIOR: ours}


def parameter_names(law: str) -> tuple[str, ...]:
    """What a search of a law may search, in the order of all tables: THETA, then what it adds."""
    return (*THETA, *LAWS[law])


def check_method(
    method: MethodParams, path: str, parameters: ParameterBoxes, optimizer: OptimizerParams
) -> None:
    """Refuse what a method, whose key ends with `path`, asks for outside the box or the budget."""
    boxes = {name: (box.low, box.high) for name, box in parameters} | LAWS[method.law]
    for name, (low, high) in method.bounds.items():
        if name not in boxes:
            raise refusal(f"{path}bounds: {name} is not one of {', '.join(boxes)}")
        least, most = boxes[name]
        if not least <= low < high <= most:
            whose = f"parameters.{name}, " if name not in LAWS[method.law] else ""
            raise refusal(
                f"{path}bounds.{name}: must be [low, high] within {whose}{least:g} to {most:g},"
                f" got {[low, high]}"
            )
    boxes |= method.bounds
    for name, value in method.fixed.items():
        if name not in boxes:
            raise refusal(f"{path}fixed: {name} is not one of {', '.join(boxes)}")
        low, high = boxes[name]
        if not low <= value <= high:
            raise refusal(
                f"{path}fixed.{name}: must be between {low:g} and {high:g}, got {value:g}"
            )
    if not {*boxes} - {*method.fixed}:
        raise refusal(f"{path}fixed: names every parameter, so none is left to search")
    iteration = (method.k_top or 1) * optimizer.cma_population
    if optimizer.cma_rollouts < iteration:
        raise refusal(
            f"{path}k_top: k_top x optimizer.cma_population = {iteration} is more than"
            f" optimizer.cma_rollouts, {optimizer.cma_rollouts}"
        )
