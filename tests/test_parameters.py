"""The table of parameters: what derives from it, and that one row adds one."""

from pathlib import Path

from sling2sim2real.base.parameters import TABLE, THETA, Parameter, parameters
from sling2sim2real.quantities import QUANTITIES
from sling2sim2real.settings.identification import LAWS, UNSEEN, ParameterBoxes
from sling2sim2real.simulator.parameters import EXTRA, names_of
from tests.project import python


def test_every_law_has_its_parameters_in_the_order_of_all_tables() -> None:
    assert tuple(ParameterBoxes.model_fields) == THETA
    for law, added in LAWS.items():
        assert names_of(law) == (*THETA, *added, *EXTRA)
        assert [row.name for row in parameters(law)] == [*names_of(law)]
    assert {*UNSEEN} == {"poissons_ratio", "dynamic_friction", "damping_scale"}


def test_rows_are_of_one_kind() -> None:
    names = [row.name for row in TABLE]
    assert len({*names}) == len(names) == len(QUANTITIES)
    for row in (row for row in TABLE if isinstance(row, Parameter)):
        assert row.reach[0] < row.reach[1]
        assert row.default is None or row.reach[0] <= row.default <= row.reach[1]
        if row.coordinate and row.coordinate.rectified and row.coordinate.prior:
            assert row.coordinate.prior[0] == row.reach[0]


def test_a_row_and_its_use_in_the_kernel_add_a_parameter(tmp_path: Path) -> None:
    done = python("-m", "tests.adds_parameter", str(tmp_path))
    assert done.returncode == 0, done.stderr
