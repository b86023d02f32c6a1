"""The gallery belongs to the rows, and says so where it does not."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.golden import gallery, gallery_page
from tests.golden.pictures import write_png
from tests.golden.rows import ROWS
from tests.golden.view import read_png


def test_the_gallery_fits_the_rows() -> None:
    assert gallery.complaints() == []


@pytest.fixture
def copied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of record, page and pictures that may be spoilt."""
    shutil.copytree(gallery_page.IMAGES, tmp_path / "images")
    shutil.copy(gallery_page.PAGE, tmp_path / "gallery.md")
    shutil.copy(gallery_page.RECORD, tmp_path / "gallery.json")
    for module in (gallery, gallery_page):
        monkeypatch.setattr(module, "IMAGES", tmp_path / "images")
        monkeypatch.setattr(module, "PAGE", tmp_path / "gallery.md")
        monkeypatch.setattr(module, "RECORD", tmp_path / "gallery.json")
    assert gallery.complaints() == []
    return tmp_path


def test_a_missing_a_wrong_and_a_spare_picture_are_reported(copied: Path) -> None:
    (copied / "images" / "point-hard.png").unlink()
    shutil.copy(copied / "images" / "sun-hard.png", copied / "images" / "sun-angle.png")
    shutil.copy(copied / "images" / "sun-hard.png", copied / "images" / "moon.png")
    told = gallery.complaints()
    parts = ("point-hard has no picture", "sun-angle.png is not the picture", "moon.png belongs to no row")
    for line, part in zip(told, parts, strict=True):
        assert line.startswith(part)


def test_a_changed_row_and_a_changed_page_are_reported(copied: Path) -> None:
    page = copied / "gallery.md"
    page.write_text(page.read_text(encoding="utf-8") + "And more.\n", encoding="utf-8")
    (line,) = gallery.complaints()
    assert line.startswith("gallery.md is not what the rows say")
    record = copied / "gallery.json"
    signature = ROWS["point-hard"].signature
    record.write_text(record.read_text(encoding="utf-8").replace(signature, "0" * 16), encoding="utf-8")
    (line,) = gallery.complaints()
    assert line.startswith("point-hard changed since its picture was made")


def test_the_page_shows_every_row_with_its_error() -> None:
    page, record = gallery_page.PAGE.read_text(encoding="utf-8"), gallery.read_record()
    for name, row in ROWS.items():
        start = page.index(f"\n### {name}\n")
        section = page[start : page.index("\n![", start)]
        assert row.title in section
        (told,) = [float(part.split(" %")[0]) for part in section.split("relRMSE **")[1:]]
        assert told == pytest.approx(100 * record[name]["error"], abs=0.0051)


@pytest.mark.parametrize("channels", [1, 3])
def test_pngs_come_back_as_they_were_written(channels: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(channels)
    smooth = np.linspace(0, 1, 20)[:, None, None] * np.linspace(0, 1, 30)[:, None]
    noise = rng.uniform(size=(20, 30, 3))
    pixels = np.round(255 * np.where(noise[..., :1] < 0.5, smooth, noise)) / 255
    pixels = np.broadcast_to(pixels[..., :channels], (20, 30, 3))
    write_png(tmp_path / "picture.png", pixels)
    np.testing.assert_allclose(read_png(tmp_path / "picture.png"), pixels, atol=1e-6)
