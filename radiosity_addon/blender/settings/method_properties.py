"""The panel's method of solving and its settings: one property for each entry of the option table."""

from __future__ import annotations

from typing import Any

import bpy

from ...options import METHODS, SETTINGS, SYMMETRIC_ONLY, BakeSettings, MethodSetting

AUTOMATIC = "0: as the quality says"

_ASSEMBLY_TEXTS = {
    "galerkin": ("Galerkin", "Area means over elements: keeps the exchange of light reciprocal"),
    "collocation": ("Collocation", "Values at the centroids of elements"),
    "linear": ("Linear", "Values at vertices, linear between them"),
}


def _property(setting: MethodSetting) -> Any:
    """Return Blender's property of a setting; 0 leaves a number to the quality."""
    words = {"name": setting.label, "description": setting.description}
    if setting.kind is bool:
        return bpy.props.BoolProperty(**words)
    if setting.kind is str:
        items = [(choice, *_ASSEMBLY_TEXTS[choice]) for choice in setting.choices]
        return bpy.props.EnumProperty(items=items, default=setting.choices[0], **words)
    words["description"] += f". {AUTOMATIC}"
    if setting.kind is int:
        return bpy.props.IntProperty(min=0, max=int(setting.high), **words)
    # Shares of the light or the area are small, gigabytes are not.
    precision = 6 if setting.high <= 1 else 3
    return bpy.props.FloatProperty(min=0.0, max=setting.high, precision=precision, **words)


class MethodProperties:
    """What `scene.radiosity` holds of the method; mixed into its property group."""

    __annotations__ = {
        "method": bpy.props.EnumProperty(
            name="Method",
            description="How the light's balance is solved. All come to the same light; Hierarchical is "
            "the fastest, the others are for study and comparison",
            items=[(name, method.label, method.description) for name, method in METHODS.items()],
            default=BakeSettings().method,
        ),
        **{name: _property(setting) for name, setting in SETTINGS.items()},
    }


def shown_settings(method: str) -> tuple[str, ...]:
    """Return the names of what there is to choose for a method."""
    fixed = {"assembly"} if method in SYMMETRIC_ONLY else set()
    return tuple(name for name in METHODS[method].settings if name not in fixed)


def given_settings(group: Any) -> dict[str, Any]:
    """Return the method and those of its settings that are not left to the quality.

    Parameters
    ----------
    group : MethodProperties
        `scene.radiosity`.
    """
    values = {name: getattr(group, name) for name in shown_settings(group.method)}
    given = {name: _as_typed(value) for name, value in values.items() if value}
    return {"method": group.method, **given}


def _as_typed(value: Any) -> Any:
    """Return what was typed: Blender keeps single precision, which makes 0.1 of it 0.10000000149."""
    return float(f"{value:.6g}") if isinstance(value, float) else value
