"""Which bake a scene needs, decided once, after the export: all of it, what changed, what moved, or nothing.

An object has changed if its triangles, their shading normals, its reflectance or opacity, its texel scale,
its page or its part in the light have. Where lamps, emission, the world or the settings have changed,
everything is baked. Lightmaps that stay are not touched: the shadows and bounces that changed objects throw
on them are not renewed.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from ..base import BakeWarning, SceneError
from ..options import BakeSettings
from ..scene import BakeScene
from .importance import scales_of
from .relight import KeptBake
from .scene_diff import (
    LightSummary,
    Part,
    changed_lights,
    compare,
    light_digest,
    rounded_digest,
    scene_record,
)

SHORT = 16
"""Characters of the digests that distinguish objects that are gone from renamed ones."""

_NAMED = 5
"""Objects that a message names."""


class RememberedLightmap(NamedTuple):
    """What is remembered of an object's lightmap.

    digest, light: Those of the object and of the light it was baked in.
    density: Texels per meter.
    has_groups: Whether each light group has a lightmap of its own.
    """

    digest: str
    light: str
    density: float
    has_groups: bool


class ShownBake(NamedTuple):
    """What is remembered of a scene's lightmaps.

    lightmaps mapping of str to RememberedLightmap: Of the objects that show one.
    objects mapping of str to str: Digest of each object that the last bake had, with a lightmap or not, cut
        to `SHORT`.
    """

    lightmaps: Mapping[str, RememberedLightmap]
    objects: Mapping[str, str]

    def gone(self, digests: BakeDigests) -> list[str]:
        """Return the objects that the last bake had and the scene has not, except for renamed ones."""
        present = {digest[:SHORT] for digest in digests.objects.values()}
        return [
            name for name in self.objects if name not in digests.objects and self.objects[name] not in present
        ]

    def altered(self, digests: BakeDigests) -> list[str]:
        """Return the objects that are not as in the last bake, except for renamed ones."""
        before = set(self.objects.values())
        return [name for name, digest in digests.objects.items() if before and digest[:SHORT] not in before]

    def edits(self, digests: BakeDigests) -> SceneEdits:
        """Return which objects are not as in the last bake."""
        altered = set(self.altered(digests))
        changed = altered & self.objects.keys()
        changed |= {
            name
            for name, lightmap in self.lightmaps.items()
            if name in digests.objects and lightmap.digest != digests.objects[name]
        }
        return SceneEdits(
            tuple(self.gone(digests)),
            tuple(name for name in digests.objects if name in changed),
            tuple(name for name in digests.objects if name in altered - changed),
        )


class SceneEdits(NamedTuple):
    """The names of objects and lights that are not as in the last bake."""

    removed: tuple[str, ...] = ()
    changed: tuple[str, ...] = ()
    added: tuple[str, ...] = ()

    def with_lights(
        self, before: Mapping[str, LightSummary], now: Mapping[str, LightSummary], *, strengths: bool
    ) -> SceneEdits:
        """Return them with the lights that are not as before, except for renamed ones, once each.

        strengths: Whether color and strength of lights count; a light of strength 0 is none.
        """
        gone = {name: light for name, light in before.items() if name not in now}
        new = {name: light for name, light in now.items() if name not in before}
        lights = (
            [name for name, light in gone.items() if strengths and light not in new.values()],
            changed_lights(before, now, strengths=strengths),
            [name for name, light in new.items() if strengths and light not in gone.values()],
        )
        known = set().union(*self)
        names = ([name for name in of if name not in known] for of in lights)
        return SceneEdits(*((*one, *other) for one, other in zip(self, names, strict=True)))

    @property
    def described(self) -> str:
        """Say what they are; "" for none."""
        parts = []
        for what, names in zip(("removed", "changed", "added"), self, strict=True):
            named = ", ".join(f"'{name}'" for name in names[:_NAMED])
            more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
            parts += [f"{what} since the last bake: {named}{more}"] if names else []
        return "; ".join(parts)


class BakeDigests(NamedTuple):
    """What is to be remembered of a bake: the digest of the light, and of each object."""

    light: str
    objects: Mapping[str, str]

    @classmethod
    def of(cls, bake_scene: BakeScene, settings: BakeSettings) -> BakeDigests:
        """Return the digests of a scene."""
        objects = {item.name: rounded_digest(bake_scene, item) for item in bake_scene.objects}
        for item in bake_scene.objects:
            if item.level is not None and item.level.base in objects:  # shows its lightmap
                both = objects[item.level.base] + objects[item.name]
                objects[item.level.base] = hashlib.sha256(both.encode()).hexdigest()
        return cls(light_digest(bake_scene, settings), objects)

    def as_before(self, shown: ShownBake, names: Collection[str]) -> BakeDigests:
        """Return them with those of some objects as in the last bake, which is not renewed for these."""
        before = {name: digest for name, digest in shown.objects.items() if name in names}
        others = {name: digest for name, digest in self.objects.items() if name not in names}
        return BakeDigests(self.light, {**others, **before})


@dataclass(frozen=True, eq=False)
class BakePlan:
    """Which bake a scene needs.

    kind: *full*; *changed*: objects that did not change keep their lightmaps; *moved*: a kept bake is updated
        for objects that moved; *nothing*.
    bake_scene: Objects that keep their lightmaps are marked as not to be baked.
    digests: What is to be remembered of the bake.
    kept: The bake to update, if *moved*.
    unchanged collection of str: The objects that keep their lightmaps.
    gone, altered: Objects that the last bake had and the scene has not, and objects without a lightmap that
        changed since, if *changed* or *nothing*.
    """

    kind: Literal["full", "changed", "moved", "nothing"]
    bake_scene: BakeScene
    settings: BakeSettings
    digests: BakeDigests
    kept: KeptBake | None = None
    unchanged: Collection[str] = ()
    gone: Sequence[str] = ()
    altered: Sequence[str] = ()

    @property
    def reason(self) -> str:
        """Why nothing is to be done."""
        if self._ignored:
            return f"no object has changed that gets a lightmap, but {self._ignored}"
        return "nothing has changed since the last bake: there is nothing to do"

    @property
    def warnings(self) -> tuple[BakeWarning, ...]:
        """What the bake does not update."""
        if self.kind != "changed":
            return ()
        message = (
            f"{len(self.unchanged)} unchanged objects kept their lightmaps, without the new light and shadow "
            "of the changed ones; bake all to update them"
        )
        return (BakeWarning("scene", f"{message}; {self._ignored}" if self._ignored else message),)

    @property
    def _ignored(self) -> str:
        """What else differs from the last bake, "" for nothing."""
        described = SceneEdits(tuple(self.gone), tuple(self.altered)).described
        return f"{described}; their light and shadow stay until you bake all" if described else ""


def plan_bake(
    bake_scene: BakeScene, settings: BakeSettings, shown: ShownBake | None, kept: KeptBake | None
) -> BakePlan:
    """Return which bake a scene needs.

    shown: If given, objects that did not change keep their lightmaps.
    kept: If given, and objects have only moved since, it is updated.
    """
    digests = BakeDigests.of(bake_scene, settings)
    if kept is not None and _moved_alone(kept, bake_scene, settings):
        return BakePlan("moved", bake_scene, settings, digests, kept)
    full = BakePlan("full", bake_scene, settings, digests)
    if shown is None:
        return full
    baked = [item.name for item in bake_scene.objects if item.bake]
    same = {
        name: lightmap
        for name, lightmap in shown.lightmaps.items()
        if name in baked and lightmap.light == digests.light and lightmap.digest == digests.objects[name]
    }
    if not same or any(lightmap.has_groups for lightmap in same.values()):
        return full
    gone = shown.gone(digests)
    altered = [name for name in shown.altered(digests) if name not in baked]
    if len(same) == len(baked):
        return BakePlan("nothing", bake_scene, settings, digests, None, same.keys(), gone, altered)
    objects = tuple(replace(item, bake=item.bake and item.name not in same) for item in bake_scene.objects)
    if settings.atlas == "shared" and settings.texel_density is None:
        # As sharp as in a bake of all, on a page of their own.
        all_baked = [item for item in bake_scene.objects if item.bake and item.count]
        scales = scales_of(bake_scene, all_baked, settings)
        thinned = {item.name: scale for item, scale in zip(all_baked, scales, strict=True)}
        objects = tuple(replace(item, thinning=thinned.get(item.name, 1.0)) for item in objects)
        density = float(np.median([lightmap.density for lightmap in same.values()]))
        settings = replace(settings, texel_density=density, pages=1)
    changed = replace(bake_scene, objects=objects)
    digests = digests.as_before(shown, {*gone, *altered})
    return BakePlan("changed", changed, settings, digests, None, same.keys(), gone, altered)


def moved_objects(kept: KeptBake, bake_scene: BakeScene) -> tuple[str, ...]:
    """Return the names of the objects that are elsewhere than when the bake was kept.

    Raises SceneError if anything else differs, or the kept bake lacks what updating it needs: also the
    insides of solids that light may reach now.
    """
    if kept.moves is None:
        raise SceneError("the kept bake can be relit, but nothing in it moved: bake again")
    diff = compare(kept.record, scene_record(bake_scene))
    diff.refuse_all_but({Part.PLACE})
    opened = _opened(kept, bake_scene)
    if opened:
        raise SceneError(
            f"light may now reach the inside of object '{opened[0]}', which the kept bake lacks: bake again"
        )
    return diff[Part.PLACE]


def _moved_alone(kept: KeptBake, bake_scene: BakeScene, settings: BakeSettings) -> bool:
    """Return whether updating a kept bake gives what a bake of the scene would."""
    if kept.moves is None or kept.settings != settings:
        return False
    if compare(kept.record, scene_record(bake_scene)).parts != {Part.PLACE}:
        return False
    return not _opened(kept, bake_scene)


def _opened(kept: KeptBake, bake_scene: BakeScene) -> list[str]:
    """Return the objects whose insides were left out of a kept bake, and are not sealed any more."""
    left_out = kept.solved.local.elements.hierarchy.faces.left_out
    opened = left_out & ~bake_scene.scene.sealed
    return [item.name for item in bake_scene.objects if opened[item.rows].any()]
