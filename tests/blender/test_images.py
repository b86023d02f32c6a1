"""Lightmap pages as Blender images: exact, deterministic, well named."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from radiosity_addon.bake.result.result import BakeResult
from radiosity_addon.base.errors import BakeError
from radiosity_addon.blender.images.images import (
    image_scale,
    lightmap_files,
    page_file_names,
    relative_path,
    set_folder,
    write_pages,
)
from radiosity_addon.lightmap.images.page import LightmapPage
from radiosity_addon.options.bake_settings import BakeSettings


def _page(seed: int = 0) -> LightmapPage:
    """Values over six decades, 3 high and 5 wide, and a zero."""
    pixels = (10 ** np.random.default_rng(seed).uniform(-3, 3, (3, 5, 3))).astype(np.float32)
    pixels[1, 2] = 0.0
    return LightmapPage(pixels, np.ones((3, 5), bool))


def _result(*pages: LightmapPage, names: tuple[str, ...] = ()) -> BakeResult:
    baked = tuple(SimpleNamespace(object=SimpleNamespace(name=name), page=i) for i, name in enumerate(names))
    return BakeResult(pages, baked, {}, ())


def _pixels(image: bpy.types.Image) -> np.ndarray:
    width, height = image.size
    values = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(height, width, image.channels)[..., :3]


def _read_back(path: Path) -> np.ndarray:
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    return _pixels(image)


def test_exr_holds_the_exact_values(tmp_path: Path) -> None:
    page = _page()
    (image,) = write_pages(_result(page), BakeSettings(), tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["lightmap.exr"]
    np.testing.assert_array_equal(_read_back(tmp_path / "lightmap.exr"), page.pixels)
    np.testing.assert_array_equal(_pixels(image), page.pixels)
    assert image.colorspace_settings.name == "Non-Color"
    assert image_scale(image) == 1.0
    assert lightmap_files([image], BakeSettings())[0].scale is None


def test_exr_holds_negative_values(tmp_path: Path) -> None:
    page = _page()
    page.pixels[:2] *= -1
    (image,) = write_pages(_result(page), BakeSettings(quantity="residual"), tmp_path)
    np.testing.assert_array_equal(_read_back(tmp_path / "lightmap.exr"), page.pixels)
    np.testing.assert_array_equal(_pixels(image), page.pixels)


def test_png_holds_values_over_scale_to_half_a_step(tmp_path: Path) -> None:
    page, settings = _page(), BakeSettings(format="png16")
    (image,) = write_pages(_result(page), settings, tmp_path)
    (file,) = lightmap_files([image], settings)
    assert file.path == "lightmap.png"
    assert file.scale == image_scale(image) == page.pixels.max()
    read = _read_back(tmp_path / file.path) * file.scale
    assert np.abs(read - page.pixels).max() <= 0.5001 * file.scale / 65535
    assert read.max() == page.pixels.max()


def test_all_pages_of_a_bake_share_one_scale(tmp_path: Path) -> None:
    dim, bright = _page(1), _page(2)
    images = write_pages(_result(dim, bright), BakeSettings(format="png16"), tmp_path)
    assert len({image_scale(image) for image in images}) == 1
    assert image_scale(images[0]) == max(dim.pixels.max(), bright.pixels.max())


def test_png_of_a_black_page_is_black(tmp_path: Path) -> None:
    black = LightmapPage(np.zeros((2, 2, 3), np.float32), np.ones((2, 2), bool))
    (image,) = write_pages(_result(black), BakeSettings(format="png16"), tmp_path)
    assert image_scale(image) == 1.0
    assert not _read_back(tmp_path / "lightmap.png").any()


@pytest.mark.parametrize("file_format", ["exr", "png16"])
def test_same_pixels_same_bytes(tmp_path: Path, file_format: str) -> None:
    contents = []
    for folder in (tmp_path / "a", tmp_path / "b"):
        folder.mkdir()
        write_pages(_result(_page(3)), BakeSettings(format=file_format), folder)
        contents.append(next(folder.iterdir()).read_bytes())
    assert contents[0] == contents[1]


@pytest.mark.parametrize("file_format", ["exr", "png16"])
def test_without_a_folder_images_are_packed_and_survive_reloading(tmp_path: Path, file_format: str) -> None:
    page, settings = _page(), BakeSettings(format=file_format)
    (image,) = write_pages(_result(page), settings, None)
    image.use_fake_user = True
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "packed.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "packed.blend"))
    (image,) = (image for image in bpy.data.images if image.packed_file)
    assert image.colorspace_settings.name == "Non-Color"
    step = 0.0 if file_format == "exr" else 0.5001 * image_scale(image) / 65535
    assert np.abs(_pixels(image) * image_scale(image) - page.pixels).max() <= step


def test_per_object_files_are_unique_whatever_the_case() -> None:
    names = ("Wall", "wall", "a/b", "a:b", "wall_2", "CON", "…", " . ")
    result = _result(*[_page()] * len(names), names=names)
    files = page_file_names(result, BakeSettings(atlas="per-object"))
    assert files[:4] == ["Wall.exr", "wall_2.exr", "a_b.exr", "a_b_2.exr"]
    assert files[5:] == ["_CON.exr", "….exr", "_.exr"]
    assert len({name.lower() for name in files}) == len(names)


def test_shared_pages_are_numbered() -> None:
    files = page_file_names(_result(_page(), _page()), BakeSettings(format="png16"))
    assert files == ["lightmap.png", "lightmap_2.png"]


def test_an_unwritable_file_is_named_and_leaves_no_image(tmp_path: Path) -> None:
    before = len(bpy.data.images)
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(BakeError, match=r"file.lightmap\.exr"):
        write_pages(_result(_page()), BakeSettings(), tmp_path / "file")
    assert len(bpy.data.images) == before


def test_paths_are_relative_to_a_saved_file_and_absolute_otherwise(tmp_path: Path) -> None:
    (image,) = write_pages(_result(_page()), BakeSettings(), tmp_path)
    assert relative_path(tmp_path / "x.exr") == str(tmp_path / "x.exr")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    set_folder([image], tmp_path / "out")
    assert image.filepath_raw.replace("\\", "/") == "//out/lightmap.exr"
