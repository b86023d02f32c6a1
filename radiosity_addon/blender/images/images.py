"""Lightmap pages as Blender images and as files.

EXR holds the values themselves in 32-bit float, PNG holds value / scale in 16 bits, linear.
Everything is Non-Color: any other setting would have Blender convert the values when it
saves or reads them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from pathlib import Path

import bpy
import numpy as np

from ...bake.layout import padding
from ...bake.relight import are_wanted
from ...bake.result import BakeResult, LightmapFile
from ...base import BakeError
from ...files import PLAIN_NAMES, FileNames, highest_page, unique_names
from ...lightmap.images import LightmapPage, encode_png16, png16_scale, presentable
from ...numerics import tiles
from ...options import OTHERS, BakeSettings
from ...scene import BakeScene
from ..datablocks.bake_record import mark_made, remove_datablocks
from ..datablocks.image_marks import (
    GROUP,
    LIGHT_PROPERTY,
    PADDING_PROPERTY,
    PAGE,
    QUANTITY_PROPERTY,
    SCALE_PROPERTY,
)
from ..datablocks.png import check_whole
from ..datablocks.quiet_output import silenced

BAND = 64
"""Rows of a page that are encoded at once."""

_FILE_FORMATS = {"exr": ("OPEN_EXR", ".exr"), "png16": ("PNG", ".png")}


def page_file_names(
    result: BakeResult,
    settings: BakeSettings,
    others: frozenset[str] = frozenset(),
    names: FileNames = PLAIN_NAMES,
) -> list[str]:
    """Name the file of every page: `lightmap.exr`, or one after each object; see `names_of_pages`."""
    return names_of_pages(names, settings, len(result.pages), _objects(result), others=others)[0]


def group_file_names(
    result: BakeResult,
    settings: BakeSettings,
    names: FileNames = PLAIN_NAMES,
    others: frozenset[str] = frozenset(),
) -> list[list[str]]:
    """Name the files of every light group's pages after the pages and the group: `lightmap_Kitchen.exr`."""
    groups = [group.name for group in result.groups]
    return names_of_pages(names, settings, len(result.pages), _objects(result), groups, others)[1:]


def names_of_pages(
    names: FileNames,
    settings: BakeSettings,
    count: int,
    objects: Sequence[str],
    groups: Sequence[str] = (),
    others: frozenset[str] = frozenset(),
) -> list[list[str]]:
    """Name the files of all pages.

    They differ from each other, from the other files of the bake, and from stems of `others`, even
    where upper and lower case do not count.

    settings: Its format and atlas.
    count: How many pages there are.
    objects: With an atlas per object, the name of each page's object.
    groups: Names of light groups.
    others frozenset of str: Stems of file names, `folded`, that are taken.
    Returns files: Those of all light, then those of each group.
    """
    ending = _FILE_FORMATS[settings.format][1]
    taken = {*others, *names.reserved(ending)}
    if settings.atlas == "per-object":
        stems = [[names.object_page(name, group) for name in objects] for group in ("", *groups)]
    else:
        stems = [names.shared_pages(count, group) for group in ("", *groups)]
    return [unique_names(of, ending, taken) for of in stems]


def possible_names(
    names: FileNames, settings: BakeSettings, bake_scene: BakeScene, folder: Path, others: frozenset[str]
) -> list[str]:
    """Return the names of all lightmaps that a bake into a folder may write, before it is known which."""
    objects = [each.name for each in bake_scene.objects if each.bake]
    wanted = are_wanted(bake_scene, settings)
    groups = (*bake_scene.light_groups, *bake_scene.emitter_groups) if wanted else None
    return names_of_any(names, settings, objects, groups, folder, others)


def names_of_any(
    names: FileNames,
    settings: BakeSettings,
    objects: Sequence[str],
    of_scene: Iterable[str] | None,
    folder: Path,
    others: frozenset[str] = frozenset(),
) -> list[str]:
    """Return the names of all lightmaps of some objects that a bake into a folder may write.

    Where a density decides how many pages there are, as many as any file there could be the last of.
    `of_scene` are the light groups that the scene's sources are in, "" for none; None if none are baked.
    """
    count = settings.pages
    if settings.atlas == "shared" and settings.texel_density is not None and folder.is_dir():
        count = max(count, highest_page([path.name for path in folder.iterdir()]))
    groups: Collection[str] = ()
    if of_scene is not None:
        groups = dict.fromkeys(filter(None, (*(name for name, _ in settings.groups), *of_scene, OTHERS)))
    found = names_of_pages(names, settings, count, objects, list(groups), others)
    return [name for of in found for name in of]


def _objects(result: BakeResult) -> list[str]:
    """Return the name of each page's object."""
    found = [""] * len(result.pages)
    for baked in reversed(result.objects):  # levels of detail come last
        found[baked.page] = baked.object.name
    return found


def write_pages(
    result: BakeResult,
    settings: BakeSettings,
    folder: Path | None,
    others: frozenset[str] = frozenset(),
    names: FileNames = PLAIN_NAMES,
) -> list[bpy.types.Image]:
    """Make an image of each page, saved into `folder` or packed into the .blend.

    settings: Its format and atlas name the files.
    folder: None packs the images.
    others frozenset of str: Stems of file names, `folded`, that are taken.
    Returns images: Parallel to `result.pages`.
    Raises BakeError if a file cannot be written.
    """
    return write_images(result.pages, page_file_names(result, settings, others, names), settings, folder)


def write_images(
    pages: Sequence[LightmapPage],
    file_names: Sequence[str],
    settings: BakeSettings,
    folder: Path | None,
    group: str = "",
) -> list[bpy.types.Image]:
    """Make an image of each page by these names; see `write_pages`. `group` is the light group they show."""
    pages = presentable(pages, signed=settings.quantity == "residual")
    scale = png16_scale(*[page.pixels for page in pages]) if settings.format == "png16" else None
    images: list[bpy.types.Image] = []
    try:
        for number, (page, file_name) in enumerate(zip(pages, file_names, strict=True)):
            images.append(_new_image(page, settings.format, file_name, scale))
            images[-1][PAGE], images[-1][GROUP] = number, group
            images[-1][QUANTITY_PROPERTY], images[-1][LIGHT_PROPERTY] = settings.quantity, settings.light
            images[-1][PADDING_PROPERTY] = padding(settings)
            _store(images[-1], folder, file_name)
    except BaseException:
        remove_datablocks(images)
        raise
    return images


def set_folder(images: Sequence[bpy.types.Image], folder: Path) -> None:
    """Point saved images at the same files in another folder, relative to a saved .blend."""
    for image in images:
        if image.packed_file is None:
            image.filepath_raw = relative_path(folder / Path(bpy.path.abspath(image.filepath_raw)).name)


def relative_path(path: Path) -> str:
    """Return Blender's `//` path from the open file; absolute if unsaved or on another drive."""
    if not bpy.data.filepath:
        return str(path)
    try:
        return bpy.path.relpath(str(path))
    except ValueError:
        return str(path)


def image_scale(image: bpy.types.Image) -> float:
    """The factor from a texel of the image to the quantity."""
    return float(image.get(SCALE_PROPERTY, 1.0))


def lightmap_files(images: Sequence[bpy.types.Image], settings: BakeSettings) -> list[LightmapFile]:
    """Entries of the images in the report: file names, and the scale where there is one."""
    scaled = settings.format == "png16"
    return [
        LightmapFile(
            Path(bpy.path.abspath(image.filepath_raw)).name or image.name,
            image_scale(image) if scaled else None,
        )
        for image in images
    ]


def _new_image(page: LightmapPage, file_format: str, file_name: str, scale: float | None) -> bpy.types.Image:
    """Make an unsaved float image of a page; `scale` is None where it is to hold the values themselves."""
    height, width = page.pixels.shape[:2]
    image = bpy.data.images.new(file_name, width, height, alpha=False, float_buffer=True, is_data=True)
    mark_made(image)
    image.file_format = _FILE_FORMATS[file_format][0]
    set_pixels(image, page, scale)
    return image


def set_pixels(image: bpy.types.Image, page: LightmapPage, scale: float | None) -> None:
    """Put a page into an image of its size, in memory; a `scale` of None puts in the values themselves."""
    if scale is not None:
        image[SCALE_PROPERTY] = scale
    pixels = np.ones((*page.pixels.shape[:2], 4), dtype=np.float32)
    for rows in tiles(len(pixels), BAND):
        values = page.pixels[rows]
        pixels[rows, :, :3] = values if scale is None else encode_png16(values, scale)
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.update_tag()


def _store(image: bpy.types.Image, folder: Path | None, file_name: str) -> None:
    """Save the image into the folder, or pack it."""
    if folder is None:
        image.pack()
        return
    save_image(image, folder / file_name)


def save_image(image: bpy.types.Image, path: Path) -> None:
    """Save an image, which then is of this file.

    Raises BakeError if it cannot be written.
    """
    image.filepath_raw = str(path)
    try:
        with silenced():  # what cannot be written is named on the terminal, too, and that by its staging path
            image.save()
        if image.file_format == "PNG":
            check_whole(path)
    except RuntimeError as error:
        raise BakeError(f"cannot write '{path}': {' '.join(str(error).split())}") from error
