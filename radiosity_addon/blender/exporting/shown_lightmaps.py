"""The lightmaps that a scene shows, as arrays of H/π, and which object shows which of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ...base import SceneError
from ...numerics import Array, radiance_of_radiosity
from ..datablocks.bake_record import is_made
from ..datablocks.image_marks import GROUP, LIGHT_PROPERTY, PADDING_PROPERTY, QUANTITY_PROPERTY
from ..datablocks.image_values import pixels_of
from ..images.images import image_scale
from ..images.light_mixer import KIND, sliders_of
from ..material_copies.material_slots import is_copy

PER_TEXEL = {"irradiance_over_pi": 1.0, "irradiance": radiance_of_radiosity(1.0)}
"""H/π of a texel of 1, for the quantities that can be exported."""


@dataclass(frozen=True)
class ShownGroup:
    """A light group: the image of each page, and the color times strength of its sliders."""

    name: str
    factor: tuple[float, float, float]
    images: tuple[bpy.types.Image, ...]


@dataclass(frozen=True)
class ShownLightmaps:
    """The lightmaps of a scene's objects.

    images: The page of all light of each number.
    groups: Light groups, whose images are parallel to `images`; none where there are none.
    page_of: By the name of each lightmap material, its page.
    light: `all`, `direct` or `indirect`.
    padding: Free texels between charts; None where that is not known.
    """

    images: tuple[bpy.types.Image, ...]
    groups: tuple[ShownGroup, ...]
    page_of: dict[str, int]
    light: str
    padding: int | None = None

    def page(self, number: int) -> Array:
        """Return H/π of a page (height, width, 3) as it is shown: light groups mixed by their sliders."""
        if not self.groups:
            return light_of(self.images[number])
        mixed = np.zeros_like(light_of(self.images[number]))
        for group in self.groups:
            mixed += np.array(group.factor, dtype=np.float32) * light_of(group.images[number])
        return mixed

    def factor_of(self, group: str) -> tuple[float, float, float]:
        """Return what the emission of surfaces in a light group is multiplied by."""
        return next((each.factor for each in self.groups if each.name == group), (1.0, 1.0, 1.0))


def shown_lightmaps(objects: Sequence[bpy.types.Object]) -> ShownLightmaps:
    """Return the lightmaps that objects show.

    Raises
    ------
    SceneError
        If they show none, or one whose file is gone, or a quantity that engines cannot use.
    """
    slots = [slot.material for obj in objects for slot in obj.material_slots]
    copies = list(dict.fromkeys(material for material in slots if is_copy(material)))
    nodes = {copy: _textures(copy) for copy in copies}
    images = list(dict.fromkeys(found[0] for found in nodes.values() if found))
    if not images:
        raise SceneError("the scene shows no lightmap: bake it first")
    quantity = images[0].get(QUANTITY_PROPERTY, "irradiance_over_pi")
    refuse_quantity(quantity)
    page_of = {copy.name: images.index(found[0]) for copy, found in nodes.items() if found}
    by_page = {images.index(found[0]): found[1:] for found in nodes.values() if found}
    groups = [
        ShownGroup(name, factor, tuple(by_page[page][row] for page in range(len(images))))
        for row, (name, factor) in enumerate(_factors(copies))
    ]
    light = str(images[0].get(LIGHT_PROPERTY, "all"))
    return ShownLightmaps(tuple(images), tuple(groups), page_of, light, images[0].get(PADDING_PROPERTY))


def refuse_quantity(quantity: str) -> None:
    """Raise SceneError for a quantity that engines cannot use."""
    if quantity not in PER_TEXEL:
        raise SceneError(
            f"the lightmap holds {quantity}, which engines cannot multiply with a color: "
            "bake with the quantity irradiance_over_pi"
        )


def light_of(image: bpy.types.Image) -> Array:
    """Return H/π of an image (height, width, 3) float32.

    Raises SceneError if its file is gone.
    """
    pixels = pixels_of(image)
    if pixels is None:
        path = Path(bpy.path.abspath(image.filepath_raw))
        raise SceneError(f"lightmap '{path}' is missing or damaged: put it back, or bake again")
    quantity = image.get(QUANTITY_PROPERTY, "irradiance_over_pi")
    return np.ascontiguousarray(pixels[..., :3]) * np.float32(PER_TEXEL[quantity] * image_scale(image))


def _textures(copy: bpy.types.Material) -> list[bpy.types.Image]:
    """Return a lightmap material's images: that of all light, then those of the groups in their order."""
    nodes = [node for node in copy.node_tree.nodes if node.type == "TEX_IMAGE" and node.image is not None]
    ours = [node.image for node in nodes if is_made(node.image)]
    whole = [image for image in ours if not image.get(GROUP)]
    shares = {image[GROUP]: image for image in ours if image.get(GROUP)}
    mixer = _mixer(copy)
    names = [] if mixer is None else [sliders.name for sliders in sliders_of(mixer)]
    return [*whole[:1], *(shares[name] for name in names if name in shares)] if whole else []


def _mixer(copy: bpy.types.Material) -> bpy.types.NodeTree | None:
    trees = [node.node_tree for node in copy.node_tree.nodes if node.type == "GROUP" and node.node_tree]
    return next((tree for tree in trees if tree.get(KIND) is not None), None)


def _factors(copies: Sequence[bpy.types.Material]) -> list[tuple[str, tuple[float, float, float]]]:
    """Return the light groups that materials mix, with color times strength."""
    mixer = next((found for copy in copies if (found := _mixer(copy)) is not None), None)
    if mixer is None:
        return []
    found = []
    for sliders in sliders_of(mixer):
        red, green, blue = (
            float(c) * sliders.strength.default_value for c in sliders.color.default_value[:3]
        )
        found.append((sliders.name, (red, green, blue)))
    return found
