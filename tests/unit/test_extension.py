"""The extension's zips: what is in them, and that the tracked manifest is left alone."""

import tomllib
import zipfile
from pathlib import Path

import pytest

from build_tools import extension
from build_tools.errors import BuildError

ROOT = Path(__file__).resolve().parents[2]
MANIFEST = (ROOT / "blender_manifest.toml").read_text(encoding="utf-8")
WHEELS = [Path("a-cp311.whl"), Path("a-cp313.whl")]


def test_a_platform_manifest_differs_in_platform_and_wheels_only() -> None:
    changed = tomllib.loads(extension.platform_manifest(MANIFEST, "macos-arm64", WHEELS))
    assert changed.pop("platforms") == ["macos-arm64"]
    assert changed.pop("wheels") == ["./wheels/a-cp311.whl", "./wheels/a-cp313.whl"]
    expected = tomllib.loads(MANIFEST)
    assert sorted(expected.pop("platforms")) == sorted(extension.PIP_PLATFORMS)
    assert changed == expected


def test_a_manifest_without_platforms_is_an_error() -> None:
    with pytest.raises(BuildError, match="platforms"):
        extension.platform_manifest('id = "x"\n', "linux-x64", WHEELS)


def test_the_tracked_manifest_keeps_the_rules_for_publishing() -> None:
    manifest = tomllib.loads(MANIFEST)
    assert manifest["id"] == "radiosity_addon"
    assert "wheels" not in manifest
    assert list(manifest["permissions"]) == ["files"]
    for text in (manifest["tagline"], *manifest["permissions"].values()):
        assert len(text) <= 64
        assert not text.endswith(".")


def test_the_zip_has_the_package_at_its_root_and_the_same_bytes_each_time(tmp_path: Path) -> None:
    wheel = tmp_path / "a-cp311.whl"
    wheel.write_bytes(b"not to be changed")
    text = extension.platform_manifest(MANIFEST, "linux-x64", [wheel])
    contents = extension.zip_contents(ROOT, text, [wheel])
    first = extension.write_zip(tmp_path / "first.zip", contents).read_bytes()
    second = extension.write_zip(tmp_path / "second.zip", dict(reversed(contents.items()))).read_bytes()
    assert first == second
    with zipfile.ZipFile(tmp_path / "first.zip") as archive:
        names = archive.namelist()
        assert archive.read("wheels/a-cp311.whl") == b"not to be changed"
        assert archive.read("__init__.py") == (ROOT / "radiosity_addon" / "__init__.py").read_bytes()
    assert {"blender_manifest.toml", "LICENSE", "scene/scene.py"} <= set(names)
    assert not [name for name in names if "__pycache__" in name or name.startswith("radiosity_addon")]
