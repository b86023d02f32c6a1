"""The zip a user installs: Blender accepts it, starts it quickly and bakes with it from the command line."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

from tests.app.real_blender.installed import Installed

ROOT = Path(__file__).resolve().parents[3]

pytestmark = pytest.mark.real_blender


@pytest.mark.parametrize("platform", ["linux-x64", "windows-x64", "macos-arm64", "macos-x64"])
def test_blender_validates_every_zip(blender, zips, platform) -> None:
    done = blender.run(
        "--command", "extension", "validate", blender.inside(zips[platform]), resources=zips[platform].parent
    )
    assert done.returncode == 0, done.stdout
    assert "Success" in done.stdout


@pytest.mark.timed
def test_registering_is_quick_and_imports_nothing_heavy(installed: Installed) -> None:
    answer = installed.answer("registration_cost.py")
    assert answer["enabled"] == [True, True]
    # About 0.05 s on the machines of 2026: Python takes a fifth of it to compile a module of 2,000 lines.
    assert min(answer["seconds"]) < 6.0 * min(answer["compiling"])
    assert not {"embreex", "xatlas", "numerics", "solver", "bake", "lightmap"} & set(answer["modules"])
    assert all(path.startswith(installed.blender.inside(installed.resources)) for path in answer["wheels"])


def test_bakes_from_blenders_command_line(installed: Installed, cornell_blend: Path) -> None:
    output = installed.folder / "baked"
    before = cornell_blend.read_bytes()
    command = ["-b", cornell_blend, "--command", "radiosity", "bake", "--output", output]
    done = installed.run(*command, "--resolution", "64", "--quality", "sketch")
    assert done.returncode == 0, done.stdout
    assert cornell_blend.read_bytes() == before
    report = json.loads((output / "report.json").read_text())
    assert report["version"] == 2
    assert report["objects"]
    for entry in report["objects"]:
        assert entry["resolution"] == [64, 64]
        assert (output / entry["image"]).stat().st_size > 0
    emitted, absorbed, escaped = (report["solver"]["power_W"][k] for k in ("emitted", "absorbed", "escaped"))
    assert absorbed + escaped == pytest.approx(emitted, rel=0.02)
    assert (output / "baked.blend").exists()
    assert (output / "preview.png").exists()
    assert (_lit_mean(output / report["objects"][0]["image"]) > 0).all()


def test_bakes_the_same_light_as_the_module(
    installed: Installed, cornell_blend: Path, tmp_path: Path
) -> None:
    bake = ["bake", "--resolution", "64", "--quality", "sketch", "--quiet", "--output"]
    in_blender = installed.folder / "same-light"
    done = installed.run("-b", cornell_blend, "--command", "radiosity", *bake, in_blender)
    assert done.returncode == 0, done.stdout
    command = [sys.executable, "-m", "radiosity_addon", *bake, tmp_path, cornell_blend]
    subprocess.run(command, cwd=ROOT, check=True, timeout=300)
    # Other versions of Python, NumPy and Blender may round, and so refine, differently.
    ours, theirs = _lit_mean(tmp_path / "lightmap.exr"), _lit_mean(in_blender / "lightmap.exr")
    assert ours == pytest.approx(theirs, rel=0.02)


def test_another_method_and_the_plot_from_blenders_command_line(
    installed: Installed, cornell_blend: Path
) -> None:
    output, plot = installed.folder / "jacobi", installed.folder / "plots" / "jacobi.svg"
    bake = ["-b", cornell_blend, "--command", "radiosity", "bake", "--resolution", "32", "--quality=sketch"]
    done = installed.run(*bake, "--output", output, "--method", "jacobi", "--elements", "100", "--plot", plot)
    assert done.returncode == 0, done.stdout
    assert json.loads((output / "report.json").read_text())["solver"]["method"] == "jacobi"
    assert "Jacobi" in plot.read_text()
    refused = installed.run(*bake, "--output", output, "--method", "jacobi", "--ambient")
    assert refused.returncode == 2
    assert "--ambient does not apply to --method jacobi" in refused.stdout


def test_restores_from_blenders_command_line(installed: Installed, cornell_blend: Path) -> None:
    baked, restored = installed.folder / "to-restore", installed.folder / "restored.blend"
    bake = ["-b", cornell_blend, "--command", "radiosity", "bake", "--output", baked]
    assert installed.run(*bake, "--resolution", "32", "--quality", "sketch").returncode == 0
    restore = ["-b", baked / "baked.blend", "--command", "radiosity", "restore", "--output", restored]
    done = installed.run(*restore)
    assert done.returncode == 0, done.stdout
    assert installed.answer("compare_files.py", cornell_blend, restored) == []


def test_exit_codes_come_through_blender(installed: Installed, cornell_blend: Path) -> None:
    command = ["-b", cornell_blend, "--command", "radiosity", "bake"]
    assert installed.run(*command).returncode == 2
    assert installed.run(*command, "--output", installed.folder / "x", "--resolution", "0").returncode == 2
    unwritable = installed.run(*command, "--output", "/proc/radiosity")
    assert unwritable.returncode == 1
    assert "/proc/radiosity" in unwritable.stdout


def test_workers_run_in_blenders_python(installed: Installed, cornell_blend: Path) -> None:
    """Those that a bake starts, and those of the command: both find the extension and its wheels."""
    ended = installed.answer("start_local_worker.py", installed.folder / "one-worker")
    assert ended == {"code": 0, "said": "exit code 0"}
    bake = ["-b", cornell_blend, "--command", "radiosity", "bake", "--resolution", "192"]
    bake += ["--quality", "sketch", "--no-preview", "--quiet", "--output"]
    alone, shared, spool = (installed.folder / name for name in ("alone", "shared", "shared-by"))
    assert installed.run(*bake, alone).returncode == 0
    done = installed.run(*bake, shared, "--farm", "local:2", "--spool", spool)
    assert done.returncode == 0, done.stdout
    assert (alone / "lightmap.exr").read_bytes() == (shared / "lightmap.exr").read_bytes()
    report = json.loads((shared / "report.json").read_text())
    assert not [each for each in report["warnings"] if each["name"] == "workers"]
    assert report["performance"]["shared"]
    done = installed.run("-b", "--command", "radiosity", "worker", spool)
    assert done.returncode == 0, done.stdout
    assert "0 tasks done" in done.stdout


def test_stages_run_in_blender(installed: Installed, cornell_blend: Path) -> None:
    """As Flamenco does it: three commands of the Blender that is installed, the middle one without a file."""
    alone, staged, spool = (installed.folder / name for name in ("at-once", "staged", "prepared-in"))
    radiosity = ["--command", "radiosity"]
    options = ["--resolution", "192", "--quality", "sketch", "--no-preview", "--quiet"]
    commands = [
        ["-b", cornell_blend, *radiosity, "bake", "--output", alone, *options],
        ["-b", cornell_blend, *radiosity, "prepare", "--spool", spool, *options],
        ["-b", *radiosity, "run", spool, "--farm", "local:1", "--quiet"],
        ["-b", cornell_blend, *radiosity, "finish", "--spool", spool, "--output", staged, "--quiet"],
    ]
    for command in commands:
        done = installed.run(*command)
        assert done.returncode == 0, done.stdout
    assert (alone / "lightmap.exr").read_bytes() == (staged / "lightmap.exr").read_bytes()
    report = json.loads((staged / "report.json").read_text())
    assert not [each for each in report["warnings"] if each["name"] == "workers"]
    assert sorted(path.name for path in spool.iterdir()) == ["finished", "over", "spool.json"]


def _lit_mean(path: Path) -> np.ndarray:
    """Mean color of the texels that hold light, (3,)."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    values = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(values)
    bpy.data.images.remove(image)
    color = values.reshape(-1, 4)[:, :3]
    return color[color.max(axis=1) > 0].mean(axis=0)
