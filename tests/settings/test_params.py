"""params.yaml is read as it is written, and every mistake in it is one line with the key's path."""

import copy
from pathlib import Path

import pytest
from dvc.utils.hydra import apply_overrides
from hypothesis import given
from hypothesis import strategies as st
from ruamel.yaml import YAML

from pipeline.params import Params, load
from sling2sim2real.base.errors import UserError
from sling2sim2real.settings import Settings
from sling2sim2real.settings.identification import LAWS, Weights
from sling2sim2real.simulator.parameters import THETA
from tests.project import BAND, DEFAULTS

TEXT = DEFAULTS.read_text(encoding="utf-8")
CONTENT = YAML(typ="safe").load(TEXT)
NOTHING = dict.fromkeys(("geom", "force", "work"), 0)
ALL_FIXED = {name: CONTENT["parameters"][name]["low"] for name in THETA}
NARROW = {"bounds": {"poissons_ratio": [0.45, 0.49]}, "fixed": {"poissons_ratio": 0.4}}


def leaves(node: object, path: tuple = ()) -> list[tuple[tuple, object]]:
    """Every (path, value) of the file that is no mapping or list."""
    if isinstance(node, dict):
        return [leaf for key, value in node.items() for leaf in leaves(value, (*path, key))]
    if isinstance(node, list):
        return [leaf for key, value in enumerate(node) for leaf in leaves(value, (*path, key))]
    return [(path, node)]


def changed(path: tuple, value: object) -> dict:
    """The content with the value at `path` replaced."""
    content = copy.deepcopy(CONTENT)
    node = content
    for part in path[:-1]:
        node = node[part]
    node[path[-1]] = value
    return content


def checked(content: object) -> Params:
    return Params.checked(content, "params.yaml")


def refusal(content: dict | str) -> str:
    with pytest.raises(UserError) as error:
        Params.parse(content) if isinstance(content, str) else checked(content)
    message = str(error.value)
    assert "\n" not in message
    return message


def test_every_number_has_a_range_and_a_type() -> None:
    numbers = [(path, v) for path, v in leaves(CONTENT) if type(v) in (int, float)]
    assert len(numbers) > 200
    for path, value in numbers:
        for wrong in (-1e30, 1e30, float("nan"), float("inf"), True, "1e-6", None):
            if wrong is None and (path[2:] == ("k_top",) or path[1:] == ("arm_stiffness",)):
                continue  # of a method: as if left out; of an arm: it does not give way
            if isinstance(value, int) and wrong in (-1e30, 1e30):
                wrong = int(wrong)
            message = refusal(changed(path, wrong))
            assert message.startswith(f"params.yaml: {'.'.join(map(str, path))}: must be "), message
            assert "between" in message


def test_the_file_has_every_key_of_the_library_and_its_default() -> None:
    """The defaults live in the models, which are no stage's dependency; DVC tracks the file.

    One value is the experiment's own: the order of a cloud's filters, as the paper has it.
    """
    content = Settings.default().model_dump(mode="json", exclude={"bands", "methods"})
    assert content["cloud"]["sampling"] == "after_filters"
    content["cloud"]["sampling"] = "before_filters"
    assert not any(content["setup"]["topics"].values())
    content["setup"]["topics"] = {}  # all are found
    delivered = {key: CONTENT[key] for key in content}
    assert delivered == content
    for name, method in Settings.default().methods.items():
        assert load(DEFAULTS).methods[name] == method


def test_a_rigs_law_has_constants_of_its_own() -> None:
    band = {**CONTENT["rig"]["bands"]["band1"], "law": "gent"}
    path = ("rig", "bands", "band1")
    assert checked(changed(path, {**band, "constants": [80]})).rig.bands["band1"].constants == (80,)
    for wrong in ([5.0], [80.0, 2.0]):
        message = refusal(changed(path, {**band, "constants": wrong}))
        expected = f"rig.bands.band1: constants: gent has [15 to 10000], got {wrong}"
        assert message == f"params.yaml: {expected}"


def test_exact_lines() -> None:
    zero = refusal(changed(("optimizer", "k_top"), 0))
    assert zero == "params.yaml: optimizer.k_top: must be between 1 and 50, got 0"
    misspelt = refusal(TEXT.replace(" k_top:", " ktop:"))
    assert misspelt == "params.yaml: optimizer.ktop: unknown key, the closest known one is k_top"
    missing = refusal(TEXT.replace("    tool_mass:", "    # tool_mass:"))
    assert missing == "params.yaml: rig.wrench.tool_mass: is missing"


RED = {"band": "band1", "recording": "red"}
SEARCH = CONTENT["run"]["search"]["band1-bo"]
REFUSED = [
    ("run.main", "paper", "run: pairs: lacks band1-dips-paper: the card of a recording is by"),
    ("run.floors", ["band1", "band1"], "run.floors: lists an entry twice"),
    ("run.floors", ["band9"], "run.floors: band9 is no band of the rig"),
    ("run.recordings", {}, "run.recordings: must not be empty"),
    ("run.recordings.band1-red", RED, "pairs: lacks band1-red-posterior: the card of a rec"),
    ("run.rig.green", {"band": "green", "recording": "plain"}, "run: recordings: must hold `rig`"),
    ("run.search.x", SEARCH, "run: search.x: must be called band1-bo, by what it is of"),
    ("run.pairs", {}, "run: pairs: must be {<<: [*multistart, *posterior, *search]}"),
    ("rig.recordings", {}, "rig.recordings: lacks plain"),
    ("rig.bands.band1", None, "rig.bands.band1: does not fit to bands.band1.source"),
    ("rig.bands.band1.constants", [0.4, 2.0, 0.1], "rig.bands.band1: constants: ogden has pairs"),
    ("bands", {"band-1": CONTENT["bands"]["band1"]}, "bands.band-1: a name has"),
    ("parameters.youngs_modulus.low", 1e8, "parameters.youngs_modulus: low must be less"),
    ("setup.draw_y", [-0.25, -0.45], "setup.draw_y: the first must be less"),
    ("setup.clamp_direction", [0, 0, 0.5], "setup.clamp_direction: the vector must have"),
    ("setup.base_to_fork", [0] * 7, "setup.base_to_fork: the quaternion must have"),
    ("force", {"cutoff": 3.2, "cutoff_unit": "rad/sample"}, "force: cutoff must be below pi"),
    ("optimizer.k_nn", 9999, "optimizer: k_nn must be at most"),
    ("optimizer.cma_rollouts", 4, "optimizer: cma_rollouts must be at least"),
    ("sling.edges", 25, "sling: edges must be even"),
    ("loss.median_window", 6, "loss: median_window must be odd"),
    ("episode.tail", 59.0, "episode: tail must be less"),
    ("episode.longest", 8.0, "episode: longest must be at least duration"),
    ("trials.targets", [0.5], "trials.targets: 0.5 lies outside policy.targets"),
    ("bands.band1.rest_length", 0.2, "bands.band1.rest_length: 0.2 must be longer than setup."),
    ("methods.de.weights", NOTHING, "methods.de.weights: at least one weight"),
    ("methods.de.search", "my.module:", "or package.module:function, got 'my.module:'"),
    ("methods.no_work.settings", {"rate": 1}, "methods.no_work: settings are for another"),
    ("methods.de.settings", {"seed": 3}, "methods.de: settings: seed stands under `optimizer`"),
    ("methods.de", CONTENT["methods"]["de"] | NARROW, "must be between 0.45 and 0.49, got 0.4"),
    ("methods.posterior.fixed", {}, "wants `fixed` to name poissons_ratio, dynamic_friction"),
    ("methods.de.bounds", {"air_drag": [0.0, 1.0]}, "air_drag is not one of youngs_modulus"),
    ("methods.de.bounds", {"poissons_ratio": [0.2, 0.4]}, "[low, high] within parameters.poissons"),
    ("methods.de.k_top", 3, "methods.de: k_top and covariance are for search: multistart"),
    ("setup.foot_height", 0.52, "setup.foot_height: must be less than setup.fork_height"),
    ("setup.draw_z", [-0.52, -0.1], "setup.draw_z: must be above the floor"),
    ("methods.de", {"law": "rubber", "bounds": {"flow": [0, 2]}}, "bounds.flow: must be [low, hi"),
    ("methods.de.fixed", {"poisson": 0.4}, "methods.de.fixed: poisson is not one of youngs_"),
    ("methods.de.fixed", {"poissons_ratio": 0.2}, "must be between 0.3 and 0.49, got 0.2"),
    ("methods.de.settings", {"rate": [1]}, "methods.de.settings.rate: must be a number, true"),
    ("methods.de.fixed", ALL_FIXED, "methods.de.fixed: names every parameter, so none is left"),
]


def test_what_is_refused_and_how_it_is_said() -> None:
    for path, value, expected in REFUSED:
        message = refusal(changed(tuple(path.split(".")), value))
        assert message.startswith(f"params.yaml: {path.partition('.')[0]}"), message
        assert expected in message


ORANGE = {"band": "orange", "recording": "plain"}


def test_a_recording_of_ones_own_needs_its_pair_by_the_main_method() -> None:
    content = copy.deepcopy(CONTENT)
    content["bands"]["orange"] = BAND
    assert "rig.bands: lacks orange; of a band that a lab recorded it is empty" in refusal(content)
    content["rig"]["bands"]["orange"] = None
    content["run"]["recordings"]["orange"] = ORANGE
    assert "pairs: lacks orange-posterior" in refusal(content)
    pair = {"orange-posterior": ORANGE | {"method": "posterior"}}
    for kind in ("posterior", "explored", "pairs"):
        content["run"][kind] |= pair
    run = checked(content).run
    assert run.first["orange"].key == "orange" and run.pairs["orange-posterior"].search is None
    content["bands"]["orange"] = BAND | {"source": "rig"}
    assert "run.rig: wants orange, whose band has source: rig" in refusal(content)
    content["bands"]["orange"], content["run"]["rig"]["orange"] = BAND, ORANGE
    assert "run.recordings alone: wants orange, whose band has source: rec" in refusal(content)


def test_a_pair_stands_under_what_its_method_searches_with() -> None:
    for change, expected in (
        ({"search": "multistart"}, "run.search: band1-de belongs under run.multistart, for method"),
        ({"search": "bo"}, "run.search.band1-de.search: must be bo: whose code it runs"),
        ({"search": "my.search:Own"}, "run.search.band1-de.search: must be own: whose code it"),
    ):
        assert expected in refusal(changed(("methods", "de"), CONTENT["methods"]["de"] | change))


def test_one_entry_runs_all_its_stages(tmp_path: Path) -> None:
    """By `dvc exp run -S`: YAML's merges take it up in the unions, and no other line moves."""
    path = tmp_path / "params.yaml"
    path.write_text(TEXT, encoding="utf-8")
    pair = "{band: band2, recording: plain, method: de, search: de}"
    apply_overrides(path, [f"+run.search.band2-de={pair}"])
    assert load(path).run.pairs["band2-de"].method == "de"
    lines = "band: band2", "recording: plain", "method: de", "search: de"
    new = "".join(["    band2-de:\n", *(f"      {line}\n" for line in lines)])
    assert path.read_text(encoding="utf-8").replace(new, "", 1) == TEXT


def test_what_a_method_leaves_out_is_as_the_defaults_say() -> None:
    method = checked(changed(("methods", "new"), {})).methods["new"]
    assert (method.search, method.k_top, method.covariance) == ("multistart", None, True)
    assert (method.settings, method.fixed, method.bounds) == ({}, {}, {})
    assert method.weights == Weights(geom=1.0, force=1.0, work=1.0)
    other = checked(changed(("method_defaults", "bounds"), {"poissons_ratio": [0.4, 0.49]})).methods
    assert other["no_work"].bounds == {"poissons_ratio": (0.4, 0.49)}
    assert {*other["posterior"].bounds} == {"poissons_ratio", *LAWS["rubber"]}
    assert refusal(changed(("method_defaults", "k_top"), 0)).startswith(
        "params.yaml: method_defaults.k_top: must be between 1 and 50"
    )
    assert "methods.de: must be a mapping" in refusal(changed(("methods", "de"), 3))


def test_a_methods_regions_need_rollouts() -> None:
    content = changed(("optimizer", "cma_rollouts"), 100)
    content["methods"]["no_work"]["k_top"] = 13
    assert "methods.no_work.k_top: k_top x optimizer.cma_population" in refusal(content)


def test_bounds_of_a_law_leave_out_what_a_method_fixes() -> None:
    rubber = {"law": "rubber", "bounds": {"flow": [0.1, 0.9]}}
    rubber |= {"fixed": ALL_FIXED | {"softening": 0.0}}  # the rest of what the law adds is left
    method = checked(changed(("methods", "de"), CONTENT["methods"]["de"] | rubber)).methods["de"]
    assert method.bounds["flow"] == (0.1, 0.9) and method.bounds["mooney_share"] == (-1.0, 0.9)
    assert {*method.bounds} == {*LAWS["rubber"]} - {"softening"}


def test_targets_beyond_the_paper_area_are_refused_though_trained() -> None:
    text = TEXT.replace("  - 1.425\n  - 2.425\n", "  - 1.0\n  - 3.0\n")
    assert Params.parse(text).policy.targets == (1.0, 3.0)
    far = text.replace("  - 1.725\n", "  - 2.8\n")
    assert "trials.targets: 2.8 lies outside the target on the floor" in refusal(far)


def test_broken_yaml_is_refused_with_its_line() -> None:
    line = TEXT[: TEXT.index("  delta:")].count("\n") + 1
    for damage in ("delta: 0.1\n  delta:", "delta: [", "delta: ]"):
        message = refusal(TEXT.replace("delta:", damage))
        assert message.startswith("params.yaml, line ")
        assert abs(int(message.split("line ")[1].split(":")[0]) - line) <= 1
    assert "must hold a mapping" in refusal("")


def test_missing_or_unreadable_file(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="nothing.yaml: no such file"):
        load(tmp_path / "nothing.yaml")
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UserError, match="binary.yaml: cannot be read"):
        load(tmp_path / "binary.yaml")


JUNK = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=8),
    st.lists(st.floats(), max_size=8),
    st.dictionaries(st.text(max_size=5) | st.integers(), st.integers(), max_size=3),
    st.dates(),
    st.binary(max_size=4),
)


@given(
    path=st.sampled_from([path[:n] for path, _ in leaves(CONTENT) for n in (1, 2, 3)]), junk=JUNK
)
def test_any_other_value_is_accepted_or_refused_in_one_line(path: tuple, junk: object) -> None:
    try:
        assert isinstance(checked(changed(path, junk)), Params)
    except UserError as error:
        assert "\n" not in str(error)


@given(data=st.data())
def test_any_damaged_text_is_accepted_or_refused_in_one_line(data: st.DataObject) -> None:
    start = data.draw(st.integers(0, len(TEXT)))
    end = data.draw(st.integers(start, min(start + 20, len(TEXT))))
    text = TEXT[:start] + data.draw(st.text(max_size=6)) + TEXT[end:]
    try:
        assert isinstance(Params.parse(text), Params)
    except UserError as error:
        assert "\n" not in str(error)


def test_names_with_control_characters_or_markup_are_refused_in_one_printable_line() -> None:
    """A prompt and a topic may be any text; what shows them cares for itself."""
    for place in (("bands",), ("methods",), ("setup",), ("setup", "topics")):
        values = (leaf for path, leaf in leaves(CONTENT) if path[: len(place)] == place)
        value = next(values, "/topic")
        for name in ("x\x1b[2J", "<script>", "../x", "a\nb", "$x$"):
            assert refusal(changed((*place, name), value)).isprintable()
