"""Words that names and prose of the project do not use; exit status 1 where one stands.

python tools/vocabulary.py

Names of Python code, and the text of docs, README, templates, comments and docstrings.
CONTRIBUTING.md says which word stands instead.
"""

from __future__ import annotations

import ast
import io
import re
import subprocess
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
NAMES = {  # and what is meant
    "told": "confidence, summary, progress, known",
    "said": "message, output, stated",
    "asked": "requested, required",
    "kept": "stored, retained, chosen",
    "felt": "hand_force, response",
    "heard": "received",
}
VAGUE = {  # as variables and parameters, and what stands instead
    "one": "what it is one of: result, row, launch",
    "found": "what was found: matches, solution, release",
    "about": "what it describes: method_params, description",
    "known": "what is known: prior, finite, defined",
    "own": "whose or what: seed, band_params",
}
PROSE = {
    r"hangs? on (?!its bands)": "depends on",
    r"\bin floors\b": "/ floor",
    r"\bis told of\b": "called for, gets",
    r"\bturn(s|ed)? them round\b": "reverse",
    r"\btook part in nothing\b": "held-out",
}
BEGINNINGS = {  # of no docstring outside the tests: it begins with what is done, or what there is
    *("As", "At", "Both", "By", "Each", "For", "From", "If", "In", "Of", "On", "That", "Those"),
    *("To", "When", "Who", "With"),
}
PYTHON, TEXT = "*.py", ("README.md", "CONTRIBUTING.md", "docs/*.md", "*.j2")


def tracked(*patterns: str) -> list[Path]:
    """Files that Git has, by pattern."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", *patterns], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return [ROOT / name for name in listed.stdout.split("\0") if name and (ROOT / name).exists()]


def names(text: str) -> Iterator[tuple[int, str]]:
    """Line and word of each name of Python code that is not to be used."""
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.NAME and token.string in NAMES:
            yield token.start[0], token.string


def variables(text: str) -> Iterator[tuple[int, str]]:
    """Line and word of each variable or parameter that says nothing of what it holds.

    Fields of classes may: a file or a table of users has them.
    """
    tree = ast.parse(text)
    classes = (node for node in ast.walk(tree) if isinstance(node, ast.ClassDef))
    fields = {part.target for node in classes for part in node.body if hasattr(part, "target")}
    for node in ast.walk(tree):
        if node in fields:
            continue
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store) and node.id in VAGUE:
            yield node.lineno, node.id
        elif isinstance(node, ast.arg) and node.arg in VAGUE:
            yield node.lineno, node.arg


def docstrings(text: str) -> Iterator[tuple[int, str]]:
    """Line and first word of each docstring that begins as no sentence does."""
    kinds = ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef
    for node in ast.walk(ast.parse(text)):
        words = isinstance(node, kinds) and (ast.get_docstring(node) or "").split()
        if words and words[0].strip(",.:;`") in BEGINNINGS:
            yield getattr(node, "lineno", 1), words[0]


def phrases(text: str) -> Iterator[tuple[int, str, str]]:
    """Line, phrase and what to write instead, of prose that is not to be used."""
    for pattern, better in PROSE.items():
        for match in re.finditer(pattern, text):
            yield text.count("\n", 0, match.start()) + 1, match[0].strip(), better


def main() -> int:
    wrong = []
    for path in tracked(PYTHON):
        if path == Path(__file__):
            continue
        text, place = path.read_text(encoding="utf-8"), path.relative_to(ROOT)
        wrong += [f"{place}:{line}: {word}: {NAMES[word]}" for line, word in names(text)]
        wrong += [f"{place}:{line}: {words}: {better}" for line, words, better in phrases(text)]
        wrong += [f"{place}:{line}: {word}: {VAGUE[word]}" for line, word in variables(text)]
        if place.parts[0] != "tests":
            wrong += [
                f"{place}:{line}: {word} ...: what it does, or what it is"
                for line, word in docstrings(text)
            ]
    for path in tracked(*TEXT):
        text, place = path.read_text(encoding="utf-8"), path.relative_to(ROOT)
        wrong += [f"{place}:{line}: {words}: {better}" for line, words, better in phrases(text)]
    print("\n".join(wrong), end="\n" if wrong else "")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
