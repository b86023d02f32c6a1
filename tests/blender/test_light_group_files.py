"""One bake of light groups: its files sum to the lightmap, and the report tells of them."""

from __future__ import annotations

import json
from pathlib import Path

import bpy
import numpy as np
import pytest

from radiosity_addon.blender.files.output import OutputFolder
from radiosity_addon.blender.images.light_mixer import mixers, sliders_of
from radiosity_addon.blender.jobs.job import run_bake
from radiosity_addon.options.bake_settings import BakeSettings
from tests.blender.scenes import add_lamp, add_mesh, set_world, shader_material

QUICK = {"resolution": 32, "quality": "sketch", "atlas": "per-object", "light_groups": True}


@pytest.fixture(autouse=True)
def room(registered: None) -> None:
    """A floor and a wall, lit by two lamps, a sign and the world."""
    add_mesh("Floor")
    add_mesh("Wall", location=(0, 1, 1), rotation_euler=(1.5707963, 0, 0))
    add_lamp("POINT", "Bulb", {"location": (0.5, -0.3, 1.2)}, energy=40.0).radiosity_light_group = "Küche: 1"
    add_lamp("SUN", "Sun", {"rotation_euler": (0.6, 0.2, 0)}, energy=2.0)
    glow = shader_material("Glow", "ShaderNodeEmission", Color=(1.0, 0.2, 0.1, 1.0), Strength=6.0)
    sign = add_mesh("Sign", material=glow, location=(-0.5, 0.5, 0.4), scale=(0.2, 0.2, 0.2))
    sign.radiosity_light_group = "küche_ 1"
    sign.radiosity_mode = "LIGHT_ONLY"
    set_world(0.2, 0.3, 0.5)


def texels(folder: Path, told: dict) -> np.ndarray:
    """What a file holds, read back."""
    image = bpy.data.images.load(str(folder / told["image"]), check_existing=False)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.array(image.pixels, dtype=np.float64).reshape(-1, image.channels)[:, :3]
    return pixels * told.get("scale", 1.0)


@pytest.mark.parametrize("file_format", ["exr", "png16"])
def test_the_files_sum_to_the_lightmap(tmp_path: Path, file_format: str) -> None:
    folder = tmp_path / "out"
    list(run_bake(bpy.context, BakeSettings(**QUICK, format=file_format), OutputFolder(folder)))
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    groups = report["light_groups"]
    assert [(told["group"], told["sources"]) for told in groups] == [
        ("Küche: 1", ["Bulb"]),
        ("küche_ 1", ["Glow"]),
        ("others", ["Sun", "World"]),
    ]
    suffix = ".exr" if file_format == "exr" else ".png"
    names = [page["image"] for told in groups for page in told["pages"]]
    assert names == [
        f"{stem}{suffix}"
        for stem in ("Floor_Küche_ 1", "Wall_Küche_ 1", "Floor_küche_ 1_2", "Wall_küche_ 1_2")
    ] + [f"Floor_others{suffix}", f"Wall_others{suffix}"]
    assert {path.name for path in folder.iterdir()} == {
        *names,
        f"Floor{suffix}",
        f"Wall{suffix}",
        "report.json",
    }
    for number, entry in enumerate(report["objects"]):
        whole = texels(folder, entry)
        parts = [texels(folder, told["pages"][number]) for told in groups]
        assert all(part.any() for part in parts)
        # Half a step of each PNG; an EXR holds float32.
        steps = sum(told.get("scale", 0.0) for told in (entry, *(group["pages"][number] for group in groups)))
        assert np.abs(sum(parts) - whole).max() <= 1e-4 * whole.mean() + steps / 131070
        relative = np.sqrt(((sum(parts) - whole) ** 2).mean()) / whole.mean()
        assert relative < 1e-4


def test_packed_groups_have_sliders_and_outlive_saving(tmp_path: Path) -> None:
    list(run_bake(bpy.context, BakeSettings(**QUICK), None))
    path = str(tmp_path / "baked.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    (mixer,) = mixers()
    assert [sliders.name for sliders in sliders_of(mixer)] == ["Küche: 1", "küche_ 1", "others"]
    packed = [image.name for image in bpy.data.images if image.packed_file is not None]
    assert len(packed) == 2 * (1 + 3)


def test_groups_named_on_the_command_line_win(tmp_path: Path) -> None:
    settings = BakeSettings(**{**QUICK, "groups": (("Sky", ("World", "Bulb")),)})
    folder = tmp_path / "out"
    list(run_bake(bpy.context, settings, OutputFolder(folder)))
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    found = [(told["group"], told["sources"]) for told in report["light_groups"]]
    assert found == [("Sky", ["Bulb", "World"]), ("küche_ 1", ["Glow"]), ("others", ["Sun"])]
