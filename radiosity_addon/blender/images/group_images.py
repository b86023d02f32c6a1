"""The lightmaps of light groups as images, and new pixels for lightmaps that are shown already."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

import bpy

from ...bake.result import BakeResult, LightGroup
from ...base import BakeError
from ...files import PLAIN_NAMES, FileNames
from ...lightmap.images import LightmapPage, png16_scale, presentable
from ...options import BakeSettings
from ..datablocks.bake_record import is_made, remove_datablocks
from ..datablocks.image_marks import GROUP, PAGE, SCALE_PROPERTY
from ..session.state import session
from .images import group_file_names, image_scale, set_pixels, write_images
from .light_mixer import KIND, set_scale
from .node_group import SCALE

GroupImages: TypeAlias = Mapping[str, Sequence[bpy.types.Image]]
"""By group, its images, parallel to the bake's pages."""


def write_groups(
    result: BakeResult,
    settings: BakeSettings,
    folder: Path | None,
    others: frozenset[str] = frozenset(),
    names: FileNames = PLAIN_NAMES,
) -> GroupImages:
    """Make an image of each page of each light group, saved into `folder` or packed; see `write_pages`.

    A PNG's scale is its group's own, so that dim groups keep as many steps as bright ones.
    """
    made: dict[str, Sequence[bpy.types.Image]] = {}
    try:
        files_of = group_file_names(result, settings, names, others)
        for group, files in zip(result.groups, files_of, strict=True):
            made[group.name] = write_images(group.pages, files, settings, folder, group.name)
    except BaseException:
        remove_datablocks(each_image(made))
        raise
    return made


def each_image(groups: GroupImages) -> Iterator[bpy.types.Image]:
    """Yield the images of all groups."""
    for images in groups.values():
        yield from images


def shown_images() -> tuple[list[bpy.types.Image], GroupImages]:
    """Return the images of the bake that this file shows, also after it was saved and opened again.

    Returns images: The pages of all light.
    Returns groups mapping of str to list of Image: Those of each light group.
    """
    own = [image for image in bpy.data.images if is_made(image) and image.library is None and PAGE in image]
    own.sort(key=lambda image: image[PAGE])
    groups: dict[str, list[bpy.types.Image]] = {}
    for image in own:
        groups.setdefault(image[GROUP], []).append(image)
    return groups.pop("", []), groups


def update_images(
    images: Sequence[bpy.types.Image],
    pages: Sequence[LightmapPage],
    group_images: GroupImages,
    groups: Sequence[LightGroup] = (),
) -> None:
    """Put new light into the images that are shown, in memory; the caller saves or packs them.

    Materials follow where an image holds scaled values and the scale changes. Images are only touched
    once all are known to fit.

    images: The lightmaps' pages.
    pages: Parallel to `images`.
    group_images mapping of str to sequence of Image: Those of each light group; empty where there are none.
    groups: The new light of the same groups.
    Raises BakeError if an image is missing, or has another size.
    """
    pages = presentable(pages)
    new = {group.name: presentable(group.pages) for group in groups}
    if set(new) != set(group_images):
        raise BakeError("the lightmaps show other light groups than these: bake again")
    sets = [(images, pages), *((group_images[name], new[name]) for name in group_images)]
    for shown, wanted in sets:
        _check_fit(shown, wanted)
    for shown, wanted in sets:
        scale = None
        if SCALE_PROPERTY in shown[0]:
            scale = png16_scale(*[page.pixels for page in wanted])
        for image, page in zip(shown, wanted, strict=True):
            if scale is not None:
                rescale_materials(image, scale)
            set_pixels(image, page, scale)
    session.lightmaps_changed()


def _check_fit(images: Sequence[bpy.types.Image], pages: Sequence[LightmapPage]) -> None:
    if len(images) != len(pages):
        raise BakeError(f"there are {len(images)} lightmap images for {len(pages)} pages: bake again")
    for image, page in zip(images, pages, strict=True):
        height, width = page.pixels.shape[:2]
        if tuple(image.size) != (width, height):
            raise BakeError(f"image '{image.name}' is not {width} × {height} pixels now: bake again")


def rescale_materials(image: bpy.types.Image, scale: float) -> None:
    """Have materials multiply an image's texels by another scale than the one it has now."""
    for node in _readers(image):
        if node.node_tree.get(KIND) is not None:
            set_scale(node.node_tree, image[GROUP], scale)
        else:
            node.inputs[SCALE].default_value *= scale / image_scale(image)


def _readers(image: bpy.types.Image) -> Iterator[bpy.types.Node]:
    """Yield the group nodes of lightmap materials that an image is wired to."""
    trees = [material.node_tree for material in bpy.data.materials if is_made(material)]
    for tree in filter(None, trees):
        for node in tree.nodes:
            if node.type == "TEX_IMAGE" and node.image == image:
                yield from (link.to_node for link in node.outputs["Color"].links)
