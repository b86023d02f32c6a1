"""Lightmap pages as Blender images and as files.

EXR holds the values themselves in 32-bit float, PNG holds value / scale in 16 bits, linear.
Everything is Non-Color: any other setting would have Blender convert the values when it
saves or reads them.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np

from ..bake_scene import BakeResult, LightmapPage
from ..errors import BakeError
from ..lightmap.encode import encode_png16, png16_scale, presentable
from ..report import LightmapFile
from ..settings import BakeSettings
from .bake_record import mark_made, remove_datablocks
from .image_marks import GROUP, PAGE, QUANTITY_PROPERTY, SCALE_PROPERTY

_FILE_FORMATS = {"exr": ("OPEN_EXR", ".exr"), "png16": ("PNG", ".png")}
_RESERVED_NAMES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)


def page_file_names(
    result: BakeResult, settings: BakeSettings, others: frozenset[str] = frozenset()
) -> list[str]:
    """Name the file of every page: `lightmap.exr`, or one after each object.

    The names differ from each other, and from stems of `others` in lower case, even where upper and lower
    case do not count.
    """
    return _file_names(_stems(result, settings), settings, set(others))


def group_file_names(result: BakeResult, settings: BakeSettings) -> list[list[str]]:
    """Name the files of every light group's pages after the pages and the group: `lightmap_Kitchen.exr`."""
    stems = _stems(result, settings)
    taken = {Path(name).stem.lower() for name in page_file_names(result, settings)}
    return [
        _file_names([sanitised_stem(f"{stem}_{group.name}") for stem in stems], settings, taken)
        for group in result.groups
    ]


def _stems(result: BakeResult, settings: BakeSettings) -> list[str]:
    """Return what the pages would be called, were there no two alike."""
    stems = ["lightmap"] * len(result.pages)
    if settings.atlas == "per-object":
        for baked in result.objects:
            stems[baked.page] = sanitised_stem(baked.object.name)
    return stems


def _file_names(stems: Sequence[str], settings: BakeSettings, taken: set[str]) -> list[str]:
    """Return file names that differ from each other and from the stems taken, and take theirs."""
    names: list[str] = []
    for stem in stems:
        unique, number = stem, 1
        while unique.lower() in taken:
            number += 1
            unique = f"{stem}_{number}"
        taken.add(unique.lower())
        names.append(unique + _FILE_FORMATS[settings.format][1])
    return names


def sanitised_stem(name: str) -> str:
    """Turn an object's name into a file name's stem that every file system takes."""
    stem = re.sub(r'[\x00-\x1f<>:"/\\|?*]', "_", name).strip(" .")[:100].strip(" .")
    return f"_{stem}" if not stem or _RESERVED_NAMES.fullmatch(stem) else stem


def write_pages(
    result: BakeResult, settings: BakeSettings, folder: Path | None, others: frozenset[str] = frozenset()
) -> list[bpy.types.Image]:
    """Make an image of each page, saved into `folder` or packed into the .blend.

    Parameters
    ----------
    result : BakeResult
    settings : BakeSettings
        Its format and atlas name the files.
    folder : Path or None
        None packs the images.
    others : frozenset of str
        Stems of file names, in lower case, that are taken.

    Returns
    -------
    images : list of Image
        Parallel to `result.pages`.

    Raises
    ------
    BakeError
        If a file cannot be written.
    """
    return write_images(result.pages, page_file_names(result, settings, others), settings, folder)


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
            images[-1][QUANTITY_PROPERTY] = settings.quantity
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
    """What a texel of the image must be multiplied by to get the quantity."""
    return float(image.get(SCALE_PROPERTY, 1.0))


def lightmap_files(images: Sequence[bpy.types.Image], settings: BakeSettings) -> list[LightmapFile]:
    """What the report says of the images: file names, and the scale where there is one."""
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
    pixels[..., :3] = page.pixels if scale is None else encode_png16(page.pixels, scale)
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    image.update_tag()


def _store(image: bpy.types.Image, folder: Path | None, file_name: str) -> None:
    """Save the image into the folder, or pack it."""
    if folder is None:
        image.pack()
        return
    path = folder / file_name
    image.filepath_raw = str(path)
    try:
        image.save()
    except RuntimeError as error:
        raise BakeError(f"cannot write '{path}': {' '.join(str(error).split())}") from error
