"""The sources of a scene's light that can be changed apart: lamps, the sky, and emissive materials.

Everything a bake computes is linear in their strengths, channel by channel. Shadow rays of emissive
surfaces are traced for groups of faces of one emission (`textured_emitters.py`);
here the groups stay within one source, so that its strength can change alone.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...base import SceneError
from ...lights import Light, SkyTable, light_strengths
from ...numerics import Array, numbered
from ...rays import RayCaster
from ...scene import Faces, Scene
from .emitters import EmitterGroup
from .textured_emitters import SAME_COLOR, emitter_groups

NO_SOURCE = -1
"""The source of a triangle that emits nothing."""


class LightSources:
    """The s sources of a scene: its lights by their number, then what emits.

    emitter (t,) int: Which emissive material each triangle has, numbers from 0; those of triangles that emit
        nothing do not count. None takes every color of emission for one, and all textures for another.
    lights: The first sources.
    groups: The emissive faces as lamps, each group of one source.
    strengths (s, 3): As they were given: a light's own (see `Light.strength`), and of what emits its exitance
        [W/m²], the largest of each channel where it varies.
    emitter (t,) int32: The number of each triangle's source less `len(lights)`, or NO_SOURCE.
    owner (g,) int64: The source of each group, likewise.
    single (s − lights,) bool: Whether all that emits is of one color.
    """

    STORED = ("lights", "groups", "strengths", "emitter", "owner", "single")

    def __init__(self, scene: Scene, faces: Faces, caster: RayCaster, emitter: Array | None = None) -> None:
        self.lights: tuple[Light, ...] = scene.lights
        emits = scene.emission.max(axis=1, initial=0.0) > 0
        self.emitter = np.full(len(scene), NO_SOURCE, dtype=np.int32)
        numbers = _by_color(scene) if emitter is None else np.asarray(emitter, dtype=np.int32)
        self.emitter[emits] = numbers[emits]
        count = int(self.emitter.max(initial=NO_SOURCE)) + 1
        self.groups: list[EmitterGroup] = []
        owner: list[int] = []
        for number in range(count):
            found = emitter_groups(scene, faces, caster, self.emitter[faces.triangle] == number)
            self.groups += found
            owner += [number] * len(found)
        self.owner = np.array(owner, dtype=np.int64)
        exitance = np.zeros((count, 3))
        np.maximum.at(exitance, self.emitter[emits], scene.emission[emits])
        self.strengths = np.concatenate([light_strengths(self.lights), exitance])
        self.single = _of_one_color(self.groups, self.owner, count)

    def __len__(self) -> int:
        return len(self.strengths)

    def checked(self, strengths: Array) -> Array:
        """Return (s, 3) float64 strengths that the sources can have.

        Raises SceneError if they are not as many, negative or not finite, or a texture would have to emit in
            a channel where it was dark: where it would is not known.
        """
        wanted = np.asarray(strengths, dtype=np.float64)
        if wanted.shape != self.strengths.shape:
            raise SceneError(
                f"strengths have shape {wanted.shape}; {self.strengths.shape}, a row a source, is needed"
            )
        if not (np.isfinite(wanted).all() and (wanted >= 0.0).all()):
            raise SceneError("a strength is negative, NaN or infinite; set it to 0 or more")
        lights = len(self.lights)
        unknown = ~self.single[:, None] & (self.strengths[lights:] == 0) & (wanted[lights:] > 0)
        if unknown.any():
            raise SceneError(
                "an emission of several colors cannot be given a channel that it did not have; bake again"
            )
        return wanted

    def of_lamps(self, strengths: Array) -> Array:
        """Return (l + g, 3): what the gains of lights and groups are multiplied with."""
        lights = len(self.lights)
        given = [strengths[:lights]]
        for group, source in zip(self.groups, self.owner, strict=True):
            given.append(self._changed(group.strength[None], source, strengths))
        return np.concatenate(given)

    def emission(self, emission: Array, triangle: Array, strengths: Array) -> Array:
        """Return (n, 3) what surfaces emit now [W/m²].

        emission (n, 3) [W/m²]: What they emitted at the strengths that were given first.
        triangle (n,) int: Whose surfaces they are.
        """
        result = emission.copy()
        emitter = self.emitter[triangle]
        for source in range(len(self.strengths) - len(self.lights)):
            rows = np.flatnonzero(emitter == source)
            result[rows] = self._changed(emission[rows], source, strengths)
        return result

    def _changed(self, before: Array, source: int, strengths: Array) -> Array:
        """Return (n, 3) what parts of an emissive source that emitted `before` (n, 3) emit now [W/m²]."""
        row = len(self.lights) + source
        was, is_now = self.strengths[row], strengths[row]
        known = was > 0
        # A channel that was dark follows the brightest one: then all parts are of one color.
        level = before.max(axis=1, initial=0.0) / was.max()
        return np.where(known, before * (is_now / np.where(known, was, 1.0)), level[:, None] * is_now)

    def sky(self, strengths: Array) -> SkyTable:
        """Return what rays that leave the scene find."""
        return SkyTable(self.lights, strengths[: len(self.lights)])


def _of_one_color(groups: Sequence[EmitterGroup], owner: Array, count: int) -> Array:
    """Return (count,) bool: the owners of groups (g,) whose strengths are in one proportion."""
    single = np.zeros(count, dtype=bool)
    for source in range(count):
        strengths = [group.strength for group, own in zip(groups, owner, strict=True) if own == source]
        colors = np.array([strength / strength.max() for strength in strengths])
        single[source] = len(colors) > 0 and bool((np.ptp(colors, axis=0) <= SAME_COLOR).all())
    return single


def _by_color(scene: Scene) -> Array:
    """Return (t,) a number for each color of emission, and the last one for all textures."""
    number = numbered(scene.emission).astype(np.int32)
    if scene.images is not None:
        number[scene.images.textured] = number.max(initial=-1) + 1
    shines = scene.emission.max(axis=1, initial=0.0) > 0
    number[shines] = numbered(number[shines])
    return number
