"""params.yaml edited: what nobody touches stays as it stands, comments included."""

from __future__ import annotations

import io
from collections.abc import Callable

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap
from ruamel.yaml.nodes import ScalarNode
from ruamel.yaml.representer import RoundTripRepresenter


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


def _null(representer: RoundTripRepresenter, _: None) -> ScalarNode:
    """Written out as it stands in the file, where ruamel would leave it empty."""
    return representer.represent_scalar("tag:yaml.org,2002:null", "null")
