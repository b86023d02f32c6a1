"""What differs between two exports of a scene, by part and name."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

from ...base import SceneError
from ...lights import Light
from ...scene import same_glow
from .lights import differs_in_strength_alone, same_light
from .record import ObjectRecord, SceneRecord


class Part(Enum):
    """What may differ, and the message about it; the first of them is reported."""

    REMOVED = "object '{}' is missing, or hidden from renders"
    ADDED = "object '{}' was not there when the lightmaps were baked"
    ORDER = "the order of the objects has changed since the lightmaps were baked"
    MESH = "object '{}' has another mesh or texel scale"
    ROLE = "the role of object '{}' has changed, or how it is baked"
    UV = "object '{}' has other lightmap coordinates"
    PLACE = "object '{}' has moved, or changed its shape"
    SURFACE = "object '{}' has another material, or Cycles' settings of caustics changed"
    MATERIAL = "material '{}' reflects differently"
    TEXTURE = "a texture of object '{}', or its UV map, has changed"
    GLOW = "the pattern that object '{}' emits has changed, or its UV map"
    EMISSION = "the emission of object '{}' has changed"
    LIGHT_ADDED = "lamp or world '{}' is new"
    LIGHT_REMOVED = "lamp or world '{}' is missing"
    LIGHT_COUNT = "the number of lights '{}' has changed"
    LIGHT_ORDER = "the order of the lights has changed since the lightmaps were baked"
    LIGHT = "lamp '{}' has changed in more than its strength"
    STRENGTH = "lamp '{}' has another color or strength"
    SETTINGS = "the settings differ from those of the bake"


RELIGHTABLE = frozenset(
    {
        *(Part.MESH, Part.UV, Part.EMISSION, Part.LIGHT_REMOVED, Part.LIGHT_ORDER, Part.STRENGTH),
        Part.SETTINGS,
    }
)
"""What may differ where a bake is relit; that emission differs in strength alone is checked with numbers."""


@dataclass(frozen=True)
class SceneDiff:
    """What differs between two exports of a scene.

    differing mapping of Part to sequence of str: Names of objects or lights; a part without names does not
        differ.
    """

    differing: Mapping[Part, Sequence[str]]

    def __getitem__(self, part: Part) -> tuple[str, ...]:
        """Return the names of what differs in a part."""
        return tuple(self.differing.get(part, ()))

    @property
    def parts(self) -> set[Part]:
        """The parts that differ."""
        return {part for part in Part if self[part]}

    def refuse_all_but(self, allowed: Collection[Part]) -> None:
        """Refuse differences in other parts than these.

        Raises SceneError: Naming the first object or light.
        """
        for part in Part:
            if part in self.parts - set(allowed):
                raise SceneError(f"{part.value.format(self[part][0])}: bake again")


def compare(before: SceneRecord, now: SceneRecord) -> SceneDiff:
    """Return what differs between a scene that was baked and the scene now."""
    both = [name for name in now.objects if name in before.objects]
    pairs = {name: (before.objects[name], now.objects[name]) for name in both}
    differing = {
        Part.REMOVED: [name for name in before.objects if name not in now.objects],
        Part.ADDED: [name for name in now.objects if name not in before.objects],
        Part.ORDER: [] if both == [name for name in before.objects if name in now.objects] else both[:1],
        **_compare_objects(pairs),
        **_compare_lights(before.lights, now.lights),
    }
    if None not in (before.settings, now.settings) and before.settings != now.settings:
        differing[Part.SETTINGS] = ["settings"]
    return SceneDiff(differing)


def _compare_objects(pairs: Mapping[str, tuple[ObjectRecord, ObjectRecord]]) -> dict[Part, list[str]]:
    tests: dict[Part, Callable[[ObjectRecord, ObjectRecord], bool]] = {
        Part.MESH: lambda one, other: one.mesh == other.mesh,
        Part.ROLE: lambda one, other: one.role == other.role,
        Part.UV: _same_uv,
        Part.PLACE: lambda one, other: one.place == other.place,
        Part.SURFACE: lambda one, other: one.surface == other.surface,
        Part.TEXTURE: lambda one, other: one.texture == other.texture,
        Part.GLOW: lambda one, other: same_glow(one.glow, other.glow),
        Part.EMISSION: lambda one, other: one.emission == other.emission and one.glow == other.glow,
    }
    return {part: [name for name, pair in pairs.items() if not same(*pair)] for part, same in tests.items()}


def _same_uv(before: ObjectRecord, now: ObjectRecord) -> bool:
    """Return whether lightmap coordinates are the same; a bake leaves those that it made on the object."""
    return now.uv == before.uv or (before.uv == "" and now.uv == before.laid_out)


def _compare_lights(before: Sequence[Light], now: Sequence[Light]) -> dict[Part, list[str]]:
    """Compare lights by name; several of one name, such as the patches of a sky, in their order."""
    names = [[light.name for light in lights] for lights in (before, now)]
    found: dict[Part, list[str]] = {
        Part.LIGHT_ADDED: [name for name in names[1] if name not in names[0]],
        Part.LIGHT_REMOVED: [name for name in names[0] if name not in names[1]],
        Part.LIGHT_ORDER: [] if names[0] == names[1] else names[1][:1],
        **{part: [] for part in (Part.LIGHT_COUNT, Part.LIGHT, Part.STRENGTH)},
    }
    for name in dict.fromkeys(name for name in names[0] if name in names[1]):
        were, are = ([light for light in lights if light.name == name] for lights in (before, now))
        if len(were) != len(are):
            found[Part.LIGHT_COUNT].append(name)
        elif not all(map(differs_in_strength_alone, were, are)):
            found[Part.LIGHT].append(name)
        elif not all(map(same_light, were, are)):
            found[Part.STRENGTH].append(name)
    return found
