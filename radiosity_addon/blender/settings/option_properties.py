"""The panel's properties of a bake's options, made from the table, and what a bake gets of them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import bpy

from ...options import OPTIONS, PANEL_OPTIONS, SYMMETRIC_ONLY, UNBOUNDED, BakeSettings, Choice, Option

PREFERRED = ("output_folder", "memory_limit", "threads")
"""Options that the preferences have too, for scenes that do not set them."""

PROPERTIES = (*PANEL_OPTIONS.values(), *(option for option in OPTIONS.values() if option.panel is not None))
"""Every option that the panel has, in the order of its rows."""

# Blender 4.5 and later want paths that start with // declared; 4.2 refuses the word.
_RELATIVE_PATH = {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set()


def automatic_source(option: Option) -> str:
    """Return what sets a number that is 0 in the panel."""
    return "preferences" if option.name in PREFERRED else "quality"


def option_property(option: Option, **more: Any) -> Any:
    """Return Blender's property of an option that the panel has; `more` replaces what follows from it."""
    row = option.panel
    assert row is not None
    words: dict[str, Any] = {"name": row.label, "description": option.description}
    if option.kind is bool:
        return bpy.props.BoolProperty(default=bool(option.default), **{**words, **more})
    if option.choices:
        choices = (*option.choices, row.other_choice) if row.other_choice else option.choices
        words["items"] = _items(choices)
        words["default"] = option.default or option.values[0]
        return bpy.props.EnumProperty(**{**words, **more})
    if option.kind is str:
        words |= {"default": option.default, "subtype": row.subtype, "options": _RELATIVE_PATH}
        return bpy.props.StringProperty(**{**words, **more})
    low, high = option.limits
    words |= {
        "min": low,
        "max": None if high == UNBOUNDED else high,
        "soft_min": row.soft_low,
        "soft_max": row.soft_high,
    }
    words |= {"default": option.default or row.default or 0, "subtype": row.subtype}
    if option.automatic:
        words |= {"description": f"{option.description}. 0 = set by {automatic_source(option)}", "min": 0}
    elif row.low is not None:
        words["min"] = row.low
    words = {name: value for name, value in {**words, **more}.items() if value is not None}
    if option.kind is int:
        return bpy.props.IntProperty(**words)
    return bpy.props.FloatProperty(precision=row.precision, step=row.step, **words)


def _items(choices: Sequence[Choice]) -> list[tuple[str, str, str, int]]:
    """Return a menu's items with the numbers that files keep: a choice that came later has one of its own."""
    places = iter(range(len(choices)))
    return [
        (choice.value, choice.label, choice.description, next(places) if number is None else number)
        for choice in choices
        for number in [choice.number]
    ]


def properties_of(group: str) -> dict[str, Any]:
    """Return the properties that a group of the scene's holds, by their identifiers."""
    return {
        option.identifier: option_property(option)
        for option in PROPERTIES
        if option.panel is not None and option.panel.group == group
    }


class OptionProperties:
    """What `scene.radiosity` holds of the options; mixed into its property group."""

    __annotations__ = properties_of("radiosity")


def is_shown(option: Option, group: Any) -> bool:
    """Return whether the panel shows an option, and a bake listens to it, as the other ones are chosen.

    group: `scene.radiosity`.
    """
    if option.panel is None or (option.methods and group.method not in option.methods):
        return False
    if option.name == "assembly" and group.method in SYMMETRIC_ONLY:
        return False
    return all(getattr(group, name) == value for name, value in option.panel.only_if)


def chosen_options(group: Any) -> dict[str, Any]:
    """Return the options that the panel shows and that are not left to the quality, by their names."""
    values = {
        name: _typed(getattr(group, option.identifier))
        for name, option in OPTIONS.items()
        if is_shown(option, group)
    }
    return {name: value for name, value in values.items() if _chosen(OPTIONS[name], value)}


def changed_labels(group: Any, settings: BakeSettings, ignored: Collection[str]) -> tuple[str, ...]:
    """Return the labels of the options that the panel now has other values of than a bake had."""
    chosen = chosen_options(group)
    return tuple(
        option.panel.label
        for name, option in OPTIONS.items()
        if option.panel is not None
        and name not in ignored
        and chosen.get(name, option.default) != getattr(settings, name)
    )


def _chosen(option: Option, value: Any) -> bool:
    """Return whether a value is a choice: 0 may leave it to the quality, a last choice to another option."""
    if option.choices:
        return value in option.values
    return option.default is not None or bool(value)


def _typed(value: Any) -> Any:
    """Return what was typed: Blender keeps single precision, which makes 0.1 of it 0.10000000149."""
    return float(f"{value:.6g}") if isinstance(value, float) else value
