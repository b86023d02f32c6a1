"""The lightmaps of a bake rewritten in place: the same images, the same files, other light."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...bake.result import BakeReport, LightGroup
from ...base import BakeError
from ...lightmap.images import LightmapPage
from ..datablocks.image_marks import MARK, SCALE_PROPERTY, VERSION
from ..files.output import OutputFolder
from ..files.ownership import OwnReport, report_listing
from ..images.group_images import rescale_materials, update_images
from ..images.images import image_scale, save_image
from . import kept_bakes, lightmap_versions
from .kept_bakes import group_images_of, images_of

OF_LIGHT = ("irradiance_W_m2", "illuminance_lx")
"""What the report says of the light on objects: of other light than this, it must not stay."""

OF_ALL_LIGHT = ("power_W", "estimated_error")
"""What it says of all light: that goes as well."""

Images = Mapping[int, bpy.types.Image]


def rewrite(mark: str, pages: Sequence[LightmapPage], groups: Sequence[LightGroup], seconds: float) -> None:
    """Show a bake's new pages, and replace its files by them, all or none.

    Parameters
    ----------
    mark : str
        The bake's.
    pages : sequence of LightmapPage
    groups : sequence of LightGroup
        Of its light groups, if it has any.
    seconds : float
        How long relighting took, for the report.

    Raises
    ------
    BakeError
        If an image is not there any more, or a file cannot be replaced.
    """
    images, group_images = images_of(mark), group_images_of(mark)
    check_images(images, pages)
    shown = [images[number] for number in range(len(pages))]
    every = [*shown, *(image for of in group_images.values() for image in of)]
    # Of a group in which nothing shines any more there are no pages.
    known = {group.name for group in groups}
    dark = tuple(LightmapPage(np.zeros_like(page.pixels), page.coverage) for page in pages)
    groups = [*groups, *(LightGroup(name, dark) for name in group_images if name not in known)]
    with _as_before_on_failure(every):
        update_images(shown, pages, group_images, groups)
        store(every, seconds)


def check_images(images: Images, pages: Sequence[LightmapPage]) -> None:
    """Refuse images that are not those of the pages.

    Raises
    ------
    BakeError
    """
    for number, page in enumerate(pages):
        image = images.get(number)
        if image is None:
            raise BakeError(f"lightmap {number + 1} of the bake is no longer in the file: bake again")
        height, width = page.pixels.shape[:2]
        if tuple(image.size) != (width, height):
            raise BakeError(f"lightmap '{image.name}' has lost its file, or was scaled: bake again")


def store(images: Sequence[bpy.types.Image], seconds: float) -> None:
    """Write the images to their files, and to the report next to them; pack those that are packed again.

    Only files that a report of their scene lists are replaced, wherever the images point.

    Raises
    ------
    BakeError
        If a file cannot be replaced, or is not ours.
    """
    folders: dict[Path, list[bpy.types.Image]] = {}
    reports: dict[Path, OwnReport] = {}
    for image in images:
        if image.packed_file is None:
            path = Path(bpy.path.abspath(image.filepath_raw))
            folders.setdefault(path.parent, []).append(image)
            reports[path.parent] = report_listing(path, _scenes_of(image))
    for image in images:
        if image.packed_file is not None:
            image.pack()
            lightmap_versions.mark([image])
    for folder, inside in folders.items():
        report = reports[folder]
        with OutputFolder(folder, report.names, owner=report.owner) as output:
            for image in inside:
                _save_into(output.staging, image)
            lightmap_versions.publish(output, _report(output, inside, seconds))
            lightmap_versions.mark(inside, report.names.report)
    lightmap_versions.check()


def _scenes_of(image: bpy.types.Image) -> list[bpy.types.Scene]:
    """Return the scenes whose bake an image shows; all where none says so."""
    scenes = [scene for scene in bpy.data.scenes if kept_bakes.mark_of(scene) == image.get(MARK)]
    return scenes or list(bpy.data.scenes)


def _save_into(folder: Path, image: bpy.types.Image) -> None:
    """Save an image under its name in another folder; it goes on belonging to its own file."""
    stored = image.filepath_raw
    try:
        save_image(image, folder / Path(bpy.path.abspath(stored)).name)
    finally:
        image.filepath_raw = stored


def _report(output: OutputFolder, images: Sequence[bpy.types.Image], seconds: float) -> BakeReport:
    """Return the report in the folder, brought up to date."""
    report: dict[str, Any] = dict(output.earlier or {})
    try:
        scales = {Path(bpy.path.abspath(image.filepath_raw)).name: image_scale(image) for image in images}
        of_groups = [page for group in report.get("light_groups", ()) for page in group["pages"]]
        for entry in (*report["objects"], *of_groups):
            if "scale" in entry:
                entry["scale"] = scales.get(entry["image"], entry["scale"])
        for entry in report["objects"]:
            for name in OF_LIGHT:
                entry.pop(name, None)
        for name in OF_ALL_LIGHT:
            report["solver"].pop(name, None)
    except (KeyError, TypeError, AttributeError):
        raise BakeError(f"'{output.path / output.names.report}' is damaged: bake again") from None
    report["relit"] = {"seconds": round(seconds, 4)}
    return BakeReport(report)


@contextmanager
def _as_before_on_failure(images: Sequence[bpy.types.Image]) -> Iterator[None]:
    """Put the images' pixels and scales back if the block fails."""
    before = []
    for image in images:
        pixels = np.empty(len(image.pixels), dtype=np.float32)
        image.pixels.foreach_get(pixels)
        before.append((image, pixels, image_scale(image), image.get(VERSION)))
    try:
        yield
    except BaseException:
        for image, pixels, scale, version in before:
            image.pixels.foreach_set(pixels)
            image.update()
            if SCALE_PROPERTY in image.keys():  # noqa: SIM118 (an ID is no dict)
                rescale_materials(image, scale)
                image[SCALE_PROPERTY] = scale
            if version is not None:
                image[VERSION] = version
        raise
