"""What a user reads of a mistake is one line, with nothing in it that a terminal obeys."""

import pytest

from pipeline.base import errors
from pipeline.base.errors import UserError, one_line

EVIL = "x\x1b[2J\u202e<b>é\n"


def test_a_mistake_is_one_printable_line(capsys) -> None:
    def main() -> None:
        raise UserError(f"{EVIL}: no such band")

    with pytest.raises(SystemExit) as ended:
        errors.run(main)
    assert ended.value.code == 1
    assert capsys.readouterr().err == "error: x\\x1b[2J\\u202e<b>é\\n: no such band\n"


def test_what_others_say_is_one_printable_line() -> None:
    assert one_line("two\n  lines\a") == r"two lines\x07"
