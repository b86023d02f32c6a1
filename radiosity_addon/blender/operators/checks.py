"""What *Check* found of each scene, and its figures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy

from ...base import duration
from ..files.ownership import panel_names
from ..relight.relight_properties import keeps, relight_of
from ..session import last_bake
from ..session.state import session
from ..settings.preferences import output_folder, preferences
from ..settings.properties import settings_of


def look(context: bpy.types.Context) -> Any:
    """Inspect the context's scene as the panel would bake it, and remember what was found."""
    from ..files.output import OutputFolder
    from ..jobs.inspection import inspect

    editing = context.mode == "EDIT_MESH"
    try:
        settings, folder = settings_of(context), output_folder(context)
        output = None if folder is None else OutputFolder(folder, panel_names(context.scene))
        kept = output is not None and keeps(context.scene, settings) and relight_of(context.scene).sidecar
        found = inspect(context, settings, folder, output, [output.names.sidecar] if output and kept else ())
    finally:
        if editing and context.mode == "OBJECT" and bpy.ops.object.mode_set.poll():
            bpy.ops.object.mode_set(mode="EDIT")
    session.checks[context.scene.name_full] = found
    return found


def last_check(scene: bpy.types.Scene) -> Any:
    """Return what was found of a scene when somebody last looked; None if nobody did."""
    return session.checks.get(scene.name_full)


def look_first(context: bpy.types.Context) -> bool:
    """Return whether a scene that was neither baked nor checked has problems the user should see first."""
    scene = context.scene
    known = last_bake.read(scene) is not None or last_check(scene) is not None
    if known or not preferences(context).check_first:
        return False
    return bool(look(context).is_odd)


def figures(found: Any) -> list[tuple[str, str]]:
    """Return what a bake will be as pairs of a name and a value."""
    plan = found.estimate
    sizes: dict[int, int] = {}
    for page in plan.pages:
        sizes[page] = sizes.get(page, 0) + 1
    pages = ", ".join(f"{count} × {size}²" for size, count in sizes.items())
    return [
        ("Objects", f"{found.objects:,}"),
        ("Triangles", f"{found.triangles:,} / {found.scene_triangles:,}"),
        ("Images", pages or "0"),
        ("Texels", f"about {_rounded(found.texels):,}, {plan.utilization:.0%} of the images"),
        ("Density", _densities(plan.densities)),
        ("Memory", f"about {plan.memory / 2**30:.1f} GiB with Blender"),
        (
            "Time",
            "until the error is reached" if plan.seconds is None else f"roughly {duration(plan.seconds)}",
        ),
    ]


def _densities(densities: Sequence[float]) -> str:
    """Return the least and the highest texels per meter of objects."""
    some = [density for density in densities if density > 0]
    if not some:
        return "0 px/m"
    low, high = f"{min(some):.2g}", f"{max(some):.2g}"
    return f"about {high} px/m" if low == high else f"about {low} to {high} px/m"


def _rounded(count: int) -> int:
    """Round to two digits: it is not known any better."""
    return int(float(f"{count:.2g}"))
