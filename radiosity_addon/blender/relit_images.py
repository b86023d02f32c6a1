"""The lightmaps of a bake rewritten in place: the same images, the same files, other light."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..bake_scene import LightGroup, LightmapPage
from ..errors import BakeError
from ..lightmap.encode import encode_png16, png16_scale
from .bake_record import is_made
from .images import SCALE_PROPERTY, image_scale
from .kept_bakes import images_of
from .node_group import SCALE
from .output import REPORT_NAME, OutputFolder

Images = Mapping[int, bpy.types.Image]


def rewrite(
    mark: str, pages: Sequence[LightmapPage], groups: Sequence[LightGroup], file_format: str, seconds: float
) -> None:
    """Show a bake's new pages, and replace its files by them, all or none.

    Parameters
    ----------
    mark : str
        The bake's.
    pages : sequence of LightmapPage
    groups : sequence of LightGroup
        Of its light groups, if it has any.
    file_format : str
        See `BakeSettings`.
    seconds : float
        How long lighting anew took, for the report.

    Raises
    ------
    BakeError
        If an image is not there any more, or a file cannot be replaced.
    """
    del groups  # no images of groups are made yet
    images = images_of(mark)
    check_images(images, pages)
    with _as_before_on_failure(images):
        show_pages(images, pages, file_format)
        store(images, seconds)


def check_images(images: Images, pages: Sequence[LightmapPage]) -> None:
    """Refuse images that are not those of the pages.

    Raises
    ------
    BakeError
    """
    for number, page in enumerate(pages):
        image = images.get(number)
        if image is None:
            raise BakeError(f"lightmap {number + 1} of the bake is not in the file any more: bake again")
        height, width = page.pixels.shape[:2]
        if tuple(image.size) != (width, height):
            raise BakeError(f"lightmap '{image.name}' has lost its file, or was scaled: bake again")


def show_pages(images: Images, pages: Sequence[LightmapPage], file_format: str) -> None:
    """Put pages into their images."""
    scale = png16_scale(*[page.pixels for page in pages]) if file_format == "png16" else None
    for number, page in enumerate(pages):
        image = images[number]
        if scale is None:
            show_pixels(image, page.pixels)
        else:
            show_pixels(image, encode_png16(page.pixels, scale))
            _set_scale(image, scale)


def show_pixels(image: bpy.types.Image, pixels: np.ndarray) -> None:
    """Put (h, w, 3) float32 pixels into an image."""
    values = np.ones((*pixels.shape[:2], 4), dtype=np.float32)
    values[..., :3] = pixels
    image.pixels.foreach_set(values.ravel())
    image.update()
    image.update_tag()


def store(images: Images, seconds: float) -> None:
    """Write the images to their files, and to the report beside them; pack anew those that are packed.

    Raises
    ------
    BakeError
        If a file cannot be replaced.
    """
    for image in images.values():
        if image.packed_file is not None:
            image.pack()
    folders: dict[Path, list[bpy.types.Image]] = {}
    for image in images.values():
        if image.packed_file is None:
            folders.setdefault(Path(bpy.path.abspath(image.filepath_raw)).parent, []).append(image)
    for folder, inside in folders.items():
        with OutputFolder(folder) as output:
            for image in inside:
                _save_into(output.staging, image)
            _report(output, inside, seconds)
            output.publish()


def _save_into(folder: Path, image: bpy.types.Image) -> None:
    """Save an image under its name in another folder; it goes on belonging to its own file."""
    stored = image.filepath_raw
    path = folder / Path(bpy.path.abspath(stored)).name
    image.filepath_raw = str(path)
    try:
        image.save()
    except RuntimeError as error:
        raise BakeError(f"cannot write '{path.name}': {' '.join(str(error).split())}") from error
    finally:
        image.filepath_raw = stored


def _report(output: OutputFolder, images: Sequence[bpy.types.Image], seconds: float) -> None:
    """Bring the report in the folder up to date, if it is there and readable."""
    try:
        told: dict[str, Any] = json.loads((output.path / REPORT_NAME).read_text(encoding="utf-8"))
        scales = {Path(bpy.path.abspath(image.filepath_raw)).name: image_scale(image) for image in images}
        for entry in told["objects"]:
            if "scale" in entry:
                entry["scale"] = scales.get(entry["image"], entry["scale"])
    except (OSError, ValueError, KeyError, TypeError):
        return
    told["relit"] = {"seconds": round(seconds, 4)}
    text = json.dumps(told, indent=2, ensure_ascii=False) + "\n"
    (output.staging / REPORT_NAME).write_text(text, encoding="utf-8")


def _set_scale(image: bpy.types.Image, scale: float) -> None:
    """Note the scale with the image, and have the materials that show it multiply by it."""
    ratio = scale / image_scale(image)
    image[SCALE_PROPERTY] = scale
    for material in bpy.data.materials:
        if not is_made(material) or material.node_tree is None:
            continue
        nodes = material.node_tree.nodes
        if any(node.type == "TEX_IMAGE" and node.image == image for node in nodes):
            for node in nodes:
                if node.type == "GROUP" and SCALE in node.inputs:
                    node.inputs[SCALE].default_value *= ratio


@contextmanager
def _as_before_on_failure(images: Images) -> Iterator[None]:
    """Put the images' pixels and scales back if the block fails."""
    before = []
    for image in images.values():
        pixels = np.empty(len(image.pixels), dtype=np.float32)
        image.pixels.foreach_get(pixels)
        before.append((image, pixels, image_scale(image)))
    try:
        yield
    except BaseException:
        for image, pixels, scale in before:
            image.pixels.foreach_set(pixels)
            image.update()
            if SCALE_PROPERTY in image.keys():  # noqa: SIM118 (an ID is no dict)
                _set_scale(image, scale)
        raise
