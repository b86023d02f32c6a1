"""What a bake warns of: objects with too few texels, and solutions that had to stop early."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ..base import BakeWarning
from ..lightmap.texels import TexelGeometry, is_collapsed
from ..lightmap.unwrap import greedy_object, share_of
from ..lights import Emitter
from ..scene import BakeObject, BakeScene, Scene, coincident_triangles
from ..solver import Solution, SolverSettings
from ..solver.element_transport import Relightable
from ..solver.links import COARSEST_FAINT
from .quality import used_settings

MAX_NAMED = 5
"""At most this many objects with coincident faces are named."""

MIN_SIDE = 8
"""Objects with fewer texels than the square of this cause a warning."""

THIN_SHARE, THIN_SHARE_OF_ALL = 0.5, 0.05
"""Objects with this share of their surface, or of that of all objects, on charts narrower than a texel and a
half cause one too: columns that look square, and feet of walls. The edge of a table top does not."""


def small_objects(
    bake_scene: BakeScene, baked: list[BakeObject], geometry: TexelGeometry
) -> Iterator[BakeWarning]:
    """Warn of objects that get hardly any texels, or only one across, and of one that takes nearly all.

    The one with the largest such surface comes first.
    """
    counts, areas = geometry.counts, bake_scene.scene.areas
    texels = [int(counts[item.rows].sum()) for item in baked]
    greedy = greedy_object([item.name for item in baked], texels)
    advice = "raise the resolution or its texel scale"
    if greedy is not None:
        taken = share_of(max(texels), sum(texels))
        advice = f"object '{greedy}' takes {taken} of all texels; lower its texel scale"
    surface = [float(areas[item.rows] @ item.lit) for item in baked]
    found: list[tuple[float, BakeWarning]] = []
    for item, own, area in zip(baked, texels, surface, strict=True):
        # A column of a hundred faces has enough texels, and no more than one across each side.
        thin = float(areas[item.rows] @ (item.lit & is_collapsed(geometry.uv[item.rows])))
        if area > 0 and own < MIN_SIDE**2:
            few = f"gets only {own} texels, fewer than {MIN_SIDE} × {MIN_SIDE}"
            found.append((area, _few_texels(item.name, few, advice)))
        elif thin > 0 and (thin >= THIN_SHARE * area or thin >= THIN_SHARE_OF_ALL * sum(surface)):
            few = f"is only one texel wide on {thin / area:.0%} of its surface ({own:,} texels in all)"
            found.append((thin, _few_texels(item.name, few, advice)))
    yield from (warning for _, warning in sorted(found, key=lambda each: -each[0]))


def _few_texels(name: str, few: str, advice: str) -> BakeWarning:
    return BakeWarning(name, f"object '{name}' {few}: {advice}")


def coincident_counts(objects: Sequence[BakeObject], scene: Scene) -> dict[str, int]:
    """Return how many triangles of each object are baked as if alone, though others are in their place."""
    found = coincident_triangles(scene)
    counts = {item.name: int(found[item.rows].sum()) for item in objects}
    return {name: count for name, count in counts.items() if count}


def of_coincident(counts: Mapping[str, int]) -> Iterator[BakeWarning]:
    """Name the objects with the most faces that are in the place of others."""
    if not counts:
        return
    names = sorted(counts, key=lambda name: (-counts[name], name))
    listed = ", ".join(f"{counts[name]:,} of '{name}'" for name in names[:MAX_NAMED])
    others = sum(counts[name] for name in names[MAX_NAMED:])
    if others:
        listed += f", {others:,} on {len(names) - MAX_NAMED} other objects"
    yield BakeWarning(
        names[0],
        f"triangles in the same place as other faces ({listed}): their lightmaps show the light of each face "
        "alone, where Cycles bakes black; delete the duplicates, or move them apart",
    )


def of_solution(solution: Solution, settings: SolverSettings) -> tuple[BakeWarning, ...]:
    """Warn where nothing shines, or the solver had to stop early."""
    warnings = []
    if solution.report["power_W"]["emitted"] == 0:
        warnings.append(
            BakeWarning(
                "scene",
                "no lamp, emissive material or world light reaches anything: the lightmaps are black; "
                "add a lamp, or bake with a sky",
            )
        )
    if solution.over_budget > 0:
        warnings.append(
            BakeWarning(
                "scene",
                f"refinement stopped at the maximum number of links; single links may misplace up to "
                f"{solution.over_budget:.2%} of the light: bake at a lower quality, or fewer objects",
            )
        )
    if solution.first_faint > COARSEST_FAINT * settings.error:
        warnings.append(
            BakeWarning(
                "scene",
                f"so many small surfaces that links begin coarse, between parts that may exchange up to "
                f"{solution.first_faint:.2%} of all light: single small faces may be lit unevenly; "
                "raise Max Links and the memory limit, or bake fewer objects",
            )
        )
    residual, tolerance = solution.report["residual"], used_settings(settings).get("tolerance", np.inf)
    if residual > tolerance:
        warnings.append(
            BakeWarning(
                "scene",
                f"the {settings.method} method stopped after {solution.report['iterations']:,} iterations "
                f"at a residual of {residual:.1e}, above the tolerance of {tolerance:.1e}: allow more "
                "iterations, or a larger tolerance",
            )
        )
    return tuple(warnings)


def of_kept_lamps(relightable: Relightable | None) -> tuple[BakeWarning, ...]:
    """Say if so many lamps are kept apart that each has fewer shadow rays than one alone needs."""
    part = 0.0 if relightable is None else relightable.local.direct.part
    if relightable is None or not 0.0 < part < 1.0:
        return ()
    lamps = sum(isinstance(light, Emitter) for light in relightable.sources.lights)
    return (
        BakeWarning(
            "scene",
            f"{lamps:,} lamps are kept for relighting and share the shadow rays of {part * lamps:,.0f}: that "
            "does not show with all of them lit, but one alone has noisier shadows than in a bake of it",
            is_note=True,
        ),
    )
