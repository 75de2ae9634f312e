"""params.yaml edited: what nobody touches stays as it stands, comments included."""

from __future__ import annotations

import io
from collections.abc import Callable

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap
from ruamel.yaml.error import CommentMark
from ruamel.yaml.nodes import ScalarNode
from ruamel.yaml.representer import RoundTripRepresenter
from ruamel.yaml.tokens import CommentToken


def edited(text: str, change: Callable[[CommentedMap], None]) -> str:
    """The text of a params.yaml after `change` has changed its content in place."""
    yaml = YAML()
    yaml.preserve_quotes = True
    yaml.width = 10_000
    yaml.representer.add_representer(type(None), _null)
    content = yaml.load(text)
    change(content)
    stream = io.StringIO()
    yaml.dump(content, stream)
    return stream.getvalue()


def append(entries: CommentedMap, name: str, value: object) -> None:
    """Add an entry right below the last one, above the blank lines that follow it.

    ruamel keeps these with the last entry's comment, and would write them before the new one.
    """
    last = next(reversed(entries), None)
    comment = (entries.ca.items.get(last) or [None, None, None])[2]
    entries[name] = value
    if comment is not None:
        own, _, blank = comment.value.partition("\n")
        comment.value = f"{own}\n"
        if blank:
            entries.ca.items[name] = [None, None, CommentToken(f"\n{blank}", CommentMark(0)), None]


def _null(representer: RoundTripRepresenter, _: None) -> ScalarNode:
    """Written out as it stands in the file, where ruamel would leave it empty."""
    return representer.represent_scalar("tag:yaml.org,2002:null", "null")
