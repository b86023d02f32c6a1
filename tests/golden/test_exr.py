"""The references' files hold what was written, and are OpenEXR to Blender too."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest

from tests.golden.exr import read_exr, write_exr


@pytest.mark.parametrize("smooth", [True, False], ids=["zipped", "as they are"])
def test_half_floats_come_back(tmp_path: Path, smooth: bool) -> None:
    rng = np.random.default_rng(1)
    height, width = 37, 21  # blocks of 16 lines do not fit
    noise = rng.integers(0, 31 << 10, (3, height, width)).astype(np.uint16).view(np.float16)
    ramp = np.broadcast_to(np.linspace(0, 1, width, dtype=np.float16), (3, height, width))
    written = dict(zip("RGB", ramp if smooth else noise, strict=True))
    write_exr(tmp_path / "a.exr", written)
    read = read_exr(tmp_path / "a.exr")
    assert list(read) == ["B", "G", "R"]
    for name, values in written.items():
        np.testing.assert_array_equal(read[name], values.astype(np.float32))
    assert ((tmp_path / "a.exr").stat().st_size < 3 * 2 * height * width) == smooth

    image = bpy.data.images.load(str(tmp_path / "a.exr"))
    image.colorspace_settings.name = "Non-Color"
    pixels = np.array(image.pixels[:], dtype=np.float32).reshape(height, width, 4)
    for channel, name in enumerate("RGB"):
        np.testing.assert_array_equal(pixels[..., channel], read[name])
