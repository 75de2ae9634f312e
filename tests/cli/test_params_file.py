"""params.yaml as DVC writes it: whatever writes it here leaves nothing for DVC to move."""

from pathlib import Path

import pytest
from dvc.utils.hydra import apply_overrides
from hypothesis import given
from hypothesis import strategies as st

from pipeline.params import Params, load
from sling2sim2real.cli.fit.fit import NewBand, corrected
from sling2sim2real.cli.params_file import edited
from sling2sim2real.cli.preflight.add_band import _with_band
from sling2sim2real.cli.remove_band import remove_band
from sling2sim2real.cli.setup import LabMeasures, set_up
from tests.project import BAND, DEFAULTS
from tools.preset import preset, write_preset

TEXT = DEFAULTS.read_text("utf-8")
SMALL = """\
# of the file

first:                  # of a section
  one: {x: 1}  # of an entry

  # above a key
  two: 2

lists:
  none: []              # of an empty list
  some:                 # of a list
  - a


# above a section
last: 1

# at the end
"""


def by_dvc(text: str, folder: Path) -> str:
    """The text after `dvc exp run -S` has set a value that it has already."""
    path = folder / "params.yaml"
    path.write_text(text, "utf-8")
    apply_overrides(path, ["optimizer.seed=1"])
    return path.read_text("utf-8")


def test_dvc_moves_no_line_of_params(tmp_path: Path) -> None:
    assert edited(TEXT, lambda content: None) == TEXT == by_dvc(TEXT, tmp_path)


def test_dvc_does_move_what_is_in_another_form(tmp_path: Path) -> None:
    """Else the tests here would prove nothing."""
    for mine, other in (
        ("  draw_z:\n  - -0.30\n  - -0.10\n", "  draw_z: [-0.30, -0.10]\n"),
        ("  urdf:  ", "  urdf: null"),
    ):
        assert mine in TEXT
        text = TEXT.replace(mine, other)
        assert by_dvc(text, tmp_path) != text


def test_a_change_and_its_reverse_leave_everything_else() -> None:
    def there(content) -> None:
        content["lists"]["none"].append("z")
        content["lists"]["some"].append("b")
        content["first"]["three"] = {"deep": [1, [2, 3]]}
        content["first"]["two"] = 3

    def back(content) -> None:
        content["lists"]["none"].remove("z")
        content["lists"]["some"].remove("b")
        del content["first"]["three"]
        content["first"]["two"] = 2

    assert edited(SMALL, lambda content: None) == SMALL
    after = edited(SMALL, there)
    assert "  none:                 # of an empty list\n  - z\n  some:" in after
    assert "  - a\n  - b\n\n\n# above a section\nlast: 1\n\n# at the end\n" in after
    deep = "    deep:\n    - 1\n    - - 2\n      - 3\n"
    assert f"\n  # above a key\n  two: 3\n  three:\n{deep}\n" in after
    assert edited(after, back) == SMALL


def test_a_text_over_several_lines_keeps_its_blank_ones() -> None:
    text = "a: |\n  one\n\n  # two\nb: 1\n"
    assert edited(text, lambda content: content.update(b=2)) == text.replace("b: 1", "b: 2")


NAMES = st.lists(st.from_regex(r"[a-z][a-z0-9_]{0,30}", fullmatch=True), max_size=8, unique=True)


@pytest.mark.slow
@given(names=NAMES, mass=st.floats(1e-4, 1), retained=st.integers(0, 8), k_top=st.integers(1, 50))
def test_whatever_is_changed_dvc_moves_no_line(
    tmp_path_factory, names, mass, retained, k_top
) -> None:
    names = [f"my_{name}" for name in names]
    folder = tmp_path_factory.mktemp("changed")

    def change(content) -> None:
        content["optimizer"]["k_top"] = k_top
        for name in names:
            content["bands"][name] = BAND | {"mass": mass}
            content["run"]["own"].append(name)
        for name in names[retained:]:
            del content["bands"][name]
            content["run"]["own"].remove(name)

    text = edited(TEXT, change)
    assert Params.parse(text).run.own == tuple(names[:retained])
    assert text == by_dvc(text, folder)


def test_all_that_write_it_write_dvcs_form(tmp_path: Path) -> None:
    path = tmp_path / "params.yaml"
    path.write_text(TEXT, "utf-8")

    def unmoved() -> None:
        text = path.read_text("utf-8")
        assert text == by_dvc(text, tmp_path)

    path.write_text(_with_band(path, "orange", BAND), "utf-8")
    unmoved()
    with corrected(path, "orange", NewBand(mass=0.05)) as params:
        assert params.bands["orange"].mass == 0.05
    unmoved()
    for name in ("large", "paper"):
        write_preset(path, preset(name))
        unmoved()
    set_up(LabMeasures(max_force=25.0, draw_y=(-0.44, -0.26)), path)
    unmoved()
    remove_band("orange", lambda lines: True, tmp_path)
    unmoved()
    assert load(path).run.own == ()
