"""What a user reads of a mistake is one line, with nothing in it that a terminal obeys."""

import errno

import pytest

from sling2sim2real.base import errors
from sling2sim2real.base.errors import UserError, one_line

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


def test_what_a_disk_refuses_is_one_line(capsys) -> None:
    """With the file, and whose it is; whatever else an operating system says is our mistake."""
    for number, says in (
        (errno.EROFS, "/: cannot be written (Read-only file system): copy the project to"),
        (errno.ENOSPC, "/: cannot be written (No space left on device)"),
        (errno.EACCES, "/: may not be read or written here (Permission denied)"),
    ):

        def main(number: int = number) -> None:
            raise OSError(number, "", "/")

        with pytest.raises(SystemExit) as ended:
            errors.run(main)
        (line,) = capsys.readouterr().err.splitlines()
        assert ended.value.code == 1 and line.startswith(f"error: {says}")
    assert errors.refused(OSError(errno.EBADF, "")) is None


def test_a_file_of_another_user_names_both(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("os.geteuid", lambda: 4321)
    message = errors.refused(PermissionError(errno.EACCES, "", str(tmp_path / "none" / "a")))
    owner = tmp_path.stat().st_uid
    assert (
        message and f"{tmp_path} is user {owner}'s, you are 4321; have it yours (chown)" in message
    )
