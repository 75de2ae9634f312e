"""Templates: a gap must be filled, lines stay as they stand, and what varies comes from beside."""

import pytest
from jinja2 import UndefinedError

from sling2sim2real.base.template import filled


def test_a_missing_value_is_refused(tmp_path) -> None:
    path = tmp_path / "a.md.j2"
    path.write_text("{{ a }}{% if b %}b{% endif %}")
    assert filled(path, a="<&>", b=False) == "<&>"
    for values in ({"a": 1}, {"b": 1}):
        with pytest.raises(UndefinedError):
            filled(path, **values)


def test_lines_stay_and_statements_leave_none(tmp_path) -> None:
    path = tmp_path / "a.md.j2"
    path.write_text("first\n  {% for n in path %}\n- {{ n }}\n  {% endfor %}\n\nlast\n")
    assert filled(path, path=[1, 2]) == "first\n- 1\n- 2\n\nlast\n"


def test_one_extends_another_of_its_folder(tmp_path) -> None:
    (tmp_path / "base.md.j2").write_text("# {{ name }}\n{% block use %}{% endblock %}\n")
    path = tmp_path / "a.md.j2"
    path.write_text('{% extends "base.md.j2" %}\n{% block use %}\nuse\n{% endblock %}\n')
    assert filled(path, name="a") == "# a\nuse\n"
