"""params.yaml edited: what nobody touches stays as it stands, comments and blank lines included.

The form is DVC's own, so that `dvc exp run -S` moves no line either: lists are blocks, lines are as
wide as ruamel has them by default, an empty value is null.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from difflib import SequenceMatcher
from typing import cast

from ruamel.yaml.comments import CommentedMap


def edited(text: str, change: Callable[[CommentedMap], object]) -> str:
    """The text of a params.yaml after `change` has changed its content in place."""
    from dvc.utils.serialize import dumps_yaml, loads_yaml, parse_yaml_for_update

    lines = text.splitlines()
    plain = [line for line in lines if not _is_aside(line)]
    if loads_yaml("\n".join(plain)) != loads_yaml(text):  # a text over several lines has such lines
        plain = lines
    content = cast(CommentedMap, parse_yaml_for_update("\n".join(plain), "params.yaml"))
    change(content)
    _lists_as_dvc_has_them(content)
    settled = dumps_yaml(parse_yaml_for_update(dumps_yaml(content), "params.yaml"))
    if plain is lines:
        return settled
    return "".join(f"{line}\n" for line in _with_asides(lines, plain, settled.splitlines()))


def _is_aside(line: str) -> bool:
    """A blank line or a comment's: ruamel keeps it with the entry before, which may go or grow."""
    return not line.strip() or line.lstrip().startswith("#")


def _with_asides(lines: list[str], plain: list[str], after: list[str]) -> Iterator[str]:
    """`after`, which was made of `plain`, with the other lines of `lines` above what they were."""
    above: list[list[str]] = [[]]
    for line in lines:
        if _is_aside(line):
            above[-1].append(line)
        else:
            above.append([])
    here = [[] for _ in after]
    for _, was, end, now, last in SequenceMatcher(None, plain, after, False).get_opcodes():
        for n in range(min(end - was, last - now)):
            here[now + n] = above[was + n]
    for asides, line in zip(here, after, strict=True):
        yield from [*asides, line]
    yield from above[-1]


def _lists_as_dvc_has_them(node: CommentedMap) -> None:
    """It writes a list that it reads anew: as a block, but where there is nothing in it."""
    if node.fa.flow_style():
        return
    for value in node.values():
        if isinstance(value, CommentedMap):
            _lists_as_dvc_has_them(value)
        elif hasattr(value, "fa"):
            value.fa.set_block_style() if value else value.fa.set_flow_style()
