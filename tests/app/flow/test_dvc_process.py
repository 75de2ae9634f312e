"""dvc.lock has the bytes that DVC's own way of writing it gives."""

import io

import hypothesis.strategies as st
from hypothesis import given, settings
from ruamel.yaml import YAML

from app.flow.dvc_process import LOCK, LockYAML
from tests.project import ROOT

NAMES = st.text("abcdefgh@-_01", min_size=1, max_size=12).filter(lambda name: name.strip("-@_"))
# The "next line" of Unicode is left out: ruamel.yaml writes it, and reads a space.
CHARACTERS = st.characters(codec="utf-8", exclude_characters="\x85")
LEAF = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats(-1e4, 1e4).map(lambda x: round(x, 6))
    | st.text(CHARACTERS, max_size=90)
)
VALUES = st.recursive(
    LEAF, lambda of: st.lists(of, max_size=3) | st.dictionaries(NAMES, of, max_size=3), max_leaves=5
)
STAGES = st.dictionaries(
    NAMES, st.dictionaries(NAMES, VALUES, min_size=1, max_size=3), min_size=1, max_size=3
)


def written(yaml: YAML, data) -> str:
    """As DVC dumps it."""
    yaml.default_flow_style = False
    stream = io.StringIO()
    yaml.dump(data, stream)
    return stream.getvalue()


@given(STAGES, STAGES)
@settings(max_examples=25, deadline=None)
def test_any_change_gives_the_same_bytes(before, changed) -> None:
    text = written(YAML(), {"schema": "2.0", "stages": before})
    assert text.startswith(LOCK)
    slow, quick = YAML().load(text), LockYAML().load(text)
    for data in (slow, quick):
        data["stages"].update(changed)
        data["stages"].pop(next(iter(before)))
    assert written(LockYAML(), quick) == written(YAML(), slow)


def test_the_lock_of_this_project() -> None:
    text = (ROOT / "dvc.lock").read_text(encoding="utf-8")
    data = LockYAML().load(text)
    assert type(data) is dict, "dvc.lock begins otherwise: it went through the slow parser"
    assert written(LockYAML(), data) == text
    first, *_, last = names = list(data["stages"])
    for name in {*names[20:], last}:  # DVC's own way takes its time
        del data["stages"][name]
    data["stages"][first]["cmd"] = "another"
    assert written(LockYAML(), data) == written(YAML(), data)


def test_other_files_keep_their_comments() -> None:
    text = "a: 1  # why\nb: 'x'\n"
    yaml = LockYAML()
    yaml.preserve_quotes = True
    assert written(yaml, yaml.load(text)) == text
