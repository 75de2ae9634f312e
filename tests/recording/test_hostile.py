"""Recordings that are made to do harm: each is refused in one line, or read without harm."""

from __future__ import annotations

import pytest
from mcap.writer import Writer

from pipeline.params import load
from sling2sim2real.base.errors import UserError, printable
from sling2sim2real.recording.streams import read_recording
from sling2sim2real.recording.words import shortened
from tests.project import DEFAULTS
from validation.recordings.bag import blind_bag

EVIL = "/../../x\x1b[2J\n\r\u202e<script>alert(1)</script>|`$(touch pwned)`"


@pytest.fixture
def setup():
    return load(DEFAULTS).setup


def test_names_are_shown_without_what_a_terminal_obeys() -> None:
    shown = printable(EVIL)
    assert shown.isprintable()
    assert "\\x1b[2J\\n\\r\\u202e<script>" in shown
    assert printable("/ft/wrench_é") == "/ft/wrench_é"
    assert shortened("a" * 50, 10) == "aaaaaaa..."


@pytest.mark.parametrize("where", ["frame", "topic"])
def test_control_characters_do_not_reach_an_error(tmp_path, setup, where) -> None:
    def change(kind, stamp, message):
        if where == "frame" and kind in ("pose", "wrench"):
            message.header.frame_id = EVIL
        if kind == "wrench" and where == "topic":
            return None
        return message

    path = blind_bag(tmp_path, change=change)
    if where == "topic":
        path.write_bytes(path.read_bytes().replace(b"/arm/current_pose", b"/arm/current_\x1b\n\rs"))
    recording = None
    try:
        recording = read_recording(path, setup)
    except UserError as error:
        assert str(error).isprintable() and len(str(error)) < 2000
    assert (recording is None) == (where == "topic")
    if recording:
        assert recording.pose.frame.isprintable()


def test_a_very_long_name_does_not_make_a_long_error(tmp_path, setup) -> None:
    path = tmp_path / "long.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("x" * 10**6, "ros2msg", b"")
        channel = writer.register_channel("/" + "y" * 10**6, "cdr", schema)
        writer.add_message(channel, 1, b"", 1)
        writer.finish()
    with pytest.raises(UserError) as caught:
        read_recording(path, setup)
    assert len(str(caught.value)) < 2000
