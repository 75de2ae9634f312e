"""How messages count, list and shorten things."""

from __future__ import annotations


def counted(count: int, what: str = "message") -> str:
    return f"{count} {what}{'s' * (count != 1)}"


def few(words: list[str], most: int) -> str:
    """The first of the words, and how many more there are."""
    more = len(words) - most
    return ", ".join(words[:most]) + (f" and {more} more" if more > 0 else "")


def shortened(text: str, most: int) -> str:
    """Cut a text to at most so many characters: names in a recording are of any length."""
    return text if len(text) <= most else f"{text[: most - 3]}..."
