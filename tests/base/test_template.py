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
