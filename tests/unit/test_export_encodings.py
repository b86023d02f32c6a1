"""Encodings of exports: errors within the bounds of their formats, and what readers find in files."""

from __future__ import annotations

import struct
import zlib

import numpy as np
import pytest

from radiosity_addon.exports import (
    decode_rgb9e5,
    decode_rgbm,
    encode_rgb9e5,
    encode_rgbm,
    png_of_linear,
    read_half_exr,
    read_ktx2,
    resampled,
    srgb_of_linear,
    write_half_exr,
    write_ktx2,
    write_rgbm,
)


def colors(seed: int = 1, shape: tuple[int, int] = (19, 33)) -> np.ndarray:
    """Colors over eight orders of magnitude, each channel its own."""
    return (10.0 ** np.random.default_rng(seed).uniform(-4, 4, (*shape, 3))).astype(np.float32)


def test_a_shared_exponent_is_off_by_a_512th_of_the_largest_channel() -> None:
    exact = colors()
    error = np.abs(decode_rgb9e5(encode_rgb9e5(exact)) - exact).max(axis=-1)
    assert (error <= exact.max(axis=-1) / 512).all()


def test_what_nine_bits_can_hold_is_exact() -> None:
    mantissas = np.random.default_rng(2).integers(0, 512, (64, 3))
    mantissas[:, 0] |= 256
    for exponent in range(32):
        exact = np.ldexp(mantissas.astype(np.float64), exponent - 24)
        np.testing.assert_array_equal(decode_rgb9e5(encode_rgb9e5(exact)), exact)


def test_a_mantissa_that_rounds_up_takes_the_next_exponent() -> None:
    value = np.array([[511.75, 1.0, 0.0]])
    np.testing.assert_array_equal(decode_rgb9e5(encode_rgb9e5(value)), [[512.0, 2.0, 0.0]])


def test_values_out_of_range_are_clamped() -> None:
    odd = np.array([[-1.0, np.nan, 0.0], [1e9, np.inf, 65408.0]])
    np.testing.assert_array_equal(decode_rgb9e5(encode_rgb9e5(odd)), [[0, 0, 0], [65408, 65408, 65408]])


def test_a_ktx2_file_holds_the_encoded_image_whichever_way_up() -> None:
    exact = colors()
    np.testing.assert_array_equal(read_ktx2(write_ktx2(exact)), decode_rgb9e5(encode_rgb9e5(exact)))


def test_a_ktx2_file_without_compression_is_aligned(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda _name: None)
    exact = colors(shape=(3, 5))
    file = write_ktx2(exact)
    (scheme,) = struct.unpack_from("<I", file, 44)
    offset, size, full = struct.unpack_from("<3Q", file, 80)
    assert (scheme, size, full, offset % 4, len(file)) == (0, 60, 60, 0, offset + 60)
    first = np.frombuffer(file, "<u4", 5, offset)
    np.testing.assert_array_equal(decode_rgb9e5(first), decode_rgb9e5(encode_rgb9e5(exact[-1])))


def test_half_floats_are_off_by_a_2048th() -> None:
    exact = colors()
    found = read_half_exr(write_half_exr(exact))
    np.testing.assert_allclose(found, exact, rtol=2.0**-11, atol=2.0**-25)


def test_rgbm_is_off_by_a_255th_of_the_brightest_channel() -> None:
    exact = colors()
    encoded, largest = encode_rgbm(exact)
    assert encoded.dtype == np.uint8
    assert largest == pytest.approx(exact.max())
    found, brightest = decode_rgbm(encoded, largest), exact.max(axis=-1)
    bound = np.maximum(brightest, largest / 255) / 255
    assert (np.abs(found - exact).max(axis=-1) <= bound * (1 + 1e-5)).all()
    assert np.abs(found - exact)[brightest > largest / 2].max() <= 0.51 * largest / 255


def test_rgbm_of_the_dark_is_black_and_keeps_its_alpha() -> None:
    light = np.zeros((2, 2, 3))
    encoded, largest = encode_rgbm(light)
    assert (encoded[..., 3] > 0).all()
    assert not decode_rgbm(encoded, largest).any()
    light[0, 0] = np.inf, np.nan, -1.0
    light[1, 1] = 5.0, 0.0, 2.5
    encoded, largest = encode_rgbm(light)
    assert largest == 5.0
    np.testing.assert_allclose(decode_rgbm(encoded, largest)[1, 1], (5.0, 0.0, 2.5), atol=0.01)
    assert not decode_rgbm(encoded, largest)[0, 0].any()


def test_equal_images_give_equal_files() -> None:
    for write in (write_half_exr, write_ktx2, png_of_linear, write_rgbm):
        assert write(colors()) == write(colors())


def test_a_png_holds_srgb_from_the_top_within_half_a_step() -> None:
    exact = np.clip(colors(shape=(7, 11)), 0.0, 1.0)
    alpha = np.linspace(0, 1, 77).reshape(7, 11)
    file = png_of_linear(exact, alpha)
    data = zlib.decompress(file[file.index(b"IDAT") + 4 : file.index(b"IEND") - 8])
    rows = np.frombuffer(data, np.uint8).reshape(7, 45)
    assert (rows[:, 0] == 2).all()
    pixels = np.cumsum(rows[:, 1:], axis=0, dtype=np.uint8).reshape(7, 11, 4)[::-1]
    assert np.abs(pixels[..., :3] / 255.0 - srgb_of_linear(exact)).max() <= 0.5 / 255 + 1e-9
    assert np.abs(pixels[..., 3] / 255.0 - alpha).max() <= 0.5 / 255 + 1e-9


def test_resampling_keeps_linear_functions_away_from_the_border() -> None:
    rows, columns = np.mgrid[0:16, 0:8] + 0.5
    page = np.stack([columns / 8, rows / 16, columns / 8 + rows / 16], axis=-1)
    rows, columns = np.mgrid[0:32, 0:16] + 0.5
    expected = np.stack([columns / 16, rows / 32, columns / 16 + rows / 32], axis=-1)
    found = resampled(page, 16, 32)
    np.testing.assert_allclose(found[1:-1, 1:-1], expected[1:-1, 1:-1], atol=1e-7)
    np.testing.assert_array_equal(found[0, 0], page[0, 0])
