"""Look in messages for names and the word that decides, whatever the sentence around them."""

from __future__ import annotations

from collections.abc import Iterable


def says(message: str, *words: str) -> bool:
    """Return whether a message holds all words."""
    return all(word in message for word in words)


def one_says(messages: Iterable[str], *words: str) -> bool:
    """Return whether one of the messages holds all words."""
    return any(says(message, *words) for message in messages)
