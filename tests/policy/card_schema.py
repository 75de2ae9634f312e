"""JSON schema (draft 2020-12) of the card beside an exported policy."""

TEXT = {"type": "string", "minLength": 1}
COUNT = {"type": "integer", "minimum": 0}
NUMBER = {"type": "number"}
POSITIVE = {"type": "number", "exclusiveMinimum": 0}
NOT_NEGATIVE = {"type": "number", "minimum": 0}
ERROR = {"type": ["number", "null"], "minimum": 0}  # m; null where nothing lands
PAIR = {"type": "array", "items": NUMBER, "minItems": 2, "maxItems": 2}


def exactly(**properties: dict) -> dict:
    """An object with these keys and no others."""
    return {
        "type": "object",
        "properties": properties,
        "required": list(properties),
        "additionalProperties": False,
    }


def port(name: str, columns: int, **more: dict) -> dict:
    """Input or output of the network."""
    shape = {"const": ["batch", columns]}
    return exactly(name={"const": name}, unit={"const": "m"}, shape=shape, meaning=TEXT, **more)


def all_in(names: str, kind: dict) -> dict:
    return exactly(**dict.fromkeys(names.split(), kind))


SETUP = (
    "fork_width_m fork_height_m projectile_mass_kg band_mass_kg band_diameter_m band_rest_length_m"
)
ARM = {"type": ["number", "null"], "exclusiveMinimum": 0}  # null: it does not give way
FIVE = {
    "youngs_modulus": POSITIVE,
    "poissons_ratio": {**POSITIVE, "exclusiveMaximum": 0.5},
    "elasticity_damping": NOT_NEGATIVE,
    "dynamic_friction": NOT_NEGATIVE,
    "damping_scale": {**NOT_NEGATIVE, "maximum": 1},
}
RUBBER = {
    "mooney_share": NUMBER,
    "upturn": NOT_NEGATIVE,
    "softening": NOT_NEGATIVE,
    "relaxation": NOT_NEGATIVE,
    "flow": NOT_NEGATIVE,
    "log_flow_rate": NUMBER,
}
SECOND = {"type": ["number", "null"]}
HAND = exactly(pull_time_s=POSITIVE, pause_s=NOT_NEGATIVE, second_more_m=SECOND)
READ_BETWEEN = exactly(draws=COUNT, mean_error_m=ERROR, max_error_m=ERROR)
TRAINING = {
    "converged": {"type": "boolean"},
    "criterion": TEXT,
    "iteration": {"type": "integer", "minimum": 1},
    "iterations": {"type": "integer", "minimum": 1},
    "mean_error_m": ERROR,
    "max_error_m": ERROR,
    "failed_targets": COUNT,
    "map_mean_error_m": ERROR,
    "failed_launches": {"type": "object", "additionalProperties": COUNT},
}
PROJECTILE = port("projectile", 2, axes={"const": ["y", "z"]}, frame=TEXT, trained_at=PAIR)
SCHEMA = {
    "$schema": "https://json-schema.org/draft/2020-12/schema",
    **exactly(
        band=TEXT,
        method=TEXT,
        theta={"anyOf": [exactly(**FIVE), exactly(**FIVE, **RUBBER)]},
        law={"enum": ["neo_hookean", "rubber"]},
        launch={"anyOf": [{"type": "null"}, HAND]},
        nuisances={"type": "object", "additionalProperties": NUMBER},
        input=port("target", 1, trained_range=PAIR),
        output=port("draw", 2, axes={"const": ["y", "z"]}, frame=TEXT, low=PAIR, high=PAIR),
        max_force_n=POSITIVE,
        made_with={"type": "object", "propertyNames": {"pattern": r"^[a-z]+\.\w+"}},
        setup=exactly(**dict.fromkeys(SETUP.split(), POSITIVE), arm_stiffness_n_m=ARM),
        training=exactly(**TRAINING),
        landing_map=exactly(box=READ_BETWEEN, target_range=READ_BETWEEN),
        trained_on=exactly(device={"type": "string", "pattern": "^(cpu|cuda)$"}),
        versions=all_in("sling2sim2real torch rsl-rl-lib onnx numpy", TEXT),
    ),
}
SCHEMA["properties"]["projectile"] = PROJECTILE  # where the policy sees it
