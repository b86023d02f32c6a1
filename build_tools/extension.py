"""The installable extension: one zip a platform, with that platform's wheels and nothing else's.

The tracked manifest is never edited: each zip gets a copy that lists its platform and wheels.
Blender itself judges the zips in `tests/app/real_blender`.
"""

from __future__ import annotations

import hashlib
import re
import shutil
import subprocess
import tomllib
import zipfile
from pathlib import Path

from .environments import Environment
from .errors import BuildError

PYTHON_VERSIONS = ("3.11", "3.13")

# The names pip knows the platforms by; the first is the newest that a wheel may ask for.
PIP_PLATFORMS = {
    "linux-x64": ("manylinux_2_28_x86_64", "manylinux_2_17_x86_64"),
    "windows-x64": ("win_amd64",),
    "macos-arm64": ("macosx_13_0_arm64",),
    "macos-x64": ("macosx_13_0_x86_64",),
}


def build(root: Path, environment: Environment, folder: Path) -> list[Path]:
    """Make `ID-VERSION-PLATFORM.zip` in `folder` for every platform of the manifest, in its order."""
    manifest_text = (root / "blender_manifest.toml").read_text(encoding="utf-8")
    manifest = tomllib.loads(manifest_text)
    folder.mkdir(exist_ok=True)
    zips = []
    for platform in manifest["platforms"]:
        wheels = _download(root, environment, platform)
        name = f"{manifest['id']}-{manifest['version']}-{platform.replace('-', '_')}.zip"
        contents = zip_contents(root, platform_manifest(manifest_text, platform, wheels), wheels)
        zips.append(write_zip(folder / name, contents))
    return zips


def platform_manifest(text: str, platform: str, wheels: list[Path]) -> str:
    """The manifest's text with `platforms` narrowed to one and its wheels listed.

    Raises
    ------
    BuildError
        If the text does not hold one `platforms = […]` line, or the result says anything else too.
    """
    listed = [f"./wheels/{wheel.name}" for wheel in wheels]
    lines = "".join(f'    "{path}",\n' for path in listed)
    replacement = f'platforms = ["{platform}"]\nwheels = [\n{lines}]'
    changed, count = re.subn(r"^platforms = \[[^\]]*\]", replacement, text, flags=re.MULTILINE)
    expected = {**tomllib.loads(text), "platforms": [platform], "wheels": listed}
    if count != 1 or tomllib.loads(changed) != expected:
        raise BuildError("blender_manifest.toml has no plain line `platforms = [...]` to narrow")
    return changed


def _download(root: Path, environment: Environment, platform: str) -> list[Path]:
    """Return the platform's wheels by name, fetched unless they lie there with pinned hashes."""
    folder = root / "build" / "wheels" / platform
    pins = root / "requirements" / "extension-wheels.txt"
    wanted = len(PYTHON_VERSIONS) * len(re.findall(r"^\w+==", pins.read_text(), flags=re.MULTILINE))
    hashes = set(re.findall(r"--hash=sha256:(\w+)", pins.read_text()))
    wheels = sorted(folder.glob("*.whl"))
    if len(wheels) == wanted and all(_sha256(wheel) in hashes for wheel in wheels):
        return wheels
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for version in PYTHON_VERSIONS:
        command = [str(environment.python), "-m", "pip", "download", "-qq", "--disable-pip-version-check"]
        command += ["--require-hashes", "--no-deps", "--only-binary=:all:", "--implementation=cp"]
        command += [f"--platform={name}" for name in PIP_PLATFORMS[platform]]
        command += [f"--python-version={version}"]
        command += ["--dest", str(folder), "-r", str(pins)]
        if subprocess.run(command, check=False).returncode != 0:
            raise BuildError(f"pip could not fetch the wheels for {platform}, Python {version} (see above)")
    wheels = sorted(folder.glob("*.whl"))
    if len(wheels) != wanted:
        raise BuildError(f"pip fetched {len(wheels)} wheels for {platform}, not one a Python and package")
    return wheels


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def zip_contents(root: Path, manifest: str, wheels: list[Path]) -> dict[str, bytes]:
    """File name in the zip → bytes. The extension's module is the package, so its files are at the top."""
    package = root / "radiosity_addon"
    sources = [path for path in package.rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    contents = {path.relative_to(package).as_posix(): path.read_bytes() for path in sources}
    contents["blender_manifest.toml"] = manifest.encode()
    contents["LICENSE"] = (root / "LICENSE").read_bytes()
    contents.update({f"wheels/{wheel.name}": wheel.read_bytes() for wheel in wheels})
    return contents


def write_zip(path: Path, contents: dict[str, bytes]) -> Path:
    """Write the same bytes for the same contents, whatever the clock and the file system say."""
    unfinished = path.with_suffix(".part")
    with zipfile.ZipFile(unfinished, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(contents):
            entry = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
            entry.external_attr = 0o644 << 16
            entry.compress_type = zipfile.ZIP_STORED if name.endswith(".whl") else zipfile.ZIP_DEFLATED
            archive.writestr(entry, contents[name])
    unfinished.replace(path)
    return path
