"""`tools/size.py` counts code, and nothing else."""

import importlib.util

import pytest

from tests.project import ROOT

SPEC = importlib.util.spec_from_file_location("size", ROOT / "tools" / "size.py")
size = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(size)

PYTHON = '''"""A docstring.

Of three lines.
"""

import os  # a comment behind code

# a comment
TEXT = """of

three lines, one of them blank"""


def function():
    """Its docstring."""
    return os
'''


@pytest.mark.parametrize(
    "text, suffix, lines",
    [
        (PYTHON, ".py", 5),
        ("/* two\nlines */\nint a; // one\n\n// none\n", ".h", 1),
        ("{# none #}\n{{ a }}\n\ntext\n", ".j2", 2),
        ("# none\necho '#'\n", ".sh", 1),
        ("// none\nconst a = 'http://b'\n", ".js", 1),
    ],
)
def test_code_lines(text, suffix, lines):
    assert size.code_lines(text, suffix) == lines


def test_folders_add_up():
    counted = size.sizes(ROOT, 1)
    assert counted["all"] == sum(counted.values()) - counted["all"] > 0
    assert set(size.BUDGETS) <= set(counted)
