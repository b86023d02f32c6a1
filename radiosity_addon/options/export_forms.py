"""The forms of an export: what the word or words after `--export` mean."""

from __future__ import annotations

from dataclasses import dataclass

from ..base import UsageError
from .choices import EXPORT_FORMS

ENGINES = ("godot", "unity", "bevy")

FORM_NAMES = ", ".join(choice.value for choice in EXPORT_FORMS)
"""All forms, for messages."""

SUM_GROUPS = (
    "Export light groups only as their sum, as the sliders stand; else also a lightmap of each, which "
    "viewer.html mixes"
)
"""Help of the option on the command line and in the panel."""

ENGINE_PADDING = 4
"""Free texels between charts that bicubic filters, and compressed blocks of 4 × 4, need."""


@dataclass(frozen=True)
class Form:
    """What an export writes: which parts of the requested forms.

    sum_groups: Light groups have no lightmaps of their own, only their sum by the factors they have.
    """

    names: tuple[str, ...]
    sum_groups: bool = False

    @property
    def lit_scene(self) -> bool:
        """Whether scene_baked.glb is written."""
        return "glb" in self.names or "web" in self.names

    @property
    def viewer(self) -> bool:
        """Whether the viewer and the loader are written."""
        return "web" in self.names

    @property
    def rgbm(self) -> bool:
        """Whether lightmaps are written as PNG images, too."""
        return "rgbm" in self.names

    @property
    def engines(self) -> tuple[str, ...]:
        """The engines among the forms."""
        return tuple(name for name in ENGINES if name in self.names)


def forms_of(text: str, sum_groups: bool = False) -> Form:
    """Return the forms of a list such as `web,godot`, without repetition.

    Raises UsageError if one is unknown, or there is none.
    """
    known = [choice.value for choice in EXPORT_FORMS]
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    unknown = [name for name in names if name not in known]
    if unknown or not names:
        wrong = f"unknown form '{unknown[0]}'" if unknown else f"no form in '{text}'"
        raise UsageError(f"{wrong}: export one or more of {FORM_NAMES}, separated by commas")
    return Form(names, sum_groups)
