"""A layout that notes what is drawn into it: Blender has none without a window."""

from __future__ import annotations

from typing import Any

Notes = list[tuple[str, tuple[Any, ...], dict[str, Any]]]


class NoteLayout:
    """Stands for Blender's layout and for all that it returns; panels in it are open.

    notes: Of every call the name, the arguments, and those given by keyword.
    """

    def __init__(self, notes: Notes) -> None:
        self.notes = notes

    def __getattr__(self, name: str) -> Any:
        def draw(*args: object, **words: object) -> NoteLayout:
            self.notes.append((name, args, words))
            return self

        return draw

    def panel(self, *args: object, **words: object) -> tuple[NoteLayout, NoteLayout]:
        self.notes.append(("panel", args, words))
        return self, self


def labels(notes: Notes) -> list[str]:
    """Return the texts of all labels, in the order they were drawn in."""
    return [words["text"] for name, _, words in notes if name == "label"]
