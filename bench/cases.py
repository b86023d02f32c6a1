"""The table of benchmarks; nothing here needs Blender."""

from __future__ import annotations

import ast
import hashlib
import json
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from radiosity_addon.options.bake_settings import BakeSettings

ROOT = Path(__file__).resolve().parents[1]
SHARED_SCENES = ROOT.parent / "shared" / "scenes"

QUALITIES: tuple[dict[str, Any], ...] = tuple(
    {"quality": quality} for quality in ("sketch", "draft", "medium", "high")
)

ERROR_SETTING = next(
    (n for n in ("target_error", "relative_error") if n in BakeSettings.__annotations__), None
)
"""The field of the target error, where this version has it."""

CONTENTS = 3
"""Version of what a prepared case's folder holds."""

ASKED_ERRORS = (0.05, 0.03, 0.02, 0.01)


@dataclass(frozen=True)
class Lamp:
    """A lamp to add to a scene that has none: its kind, place, energy [W, or W/m²] and radius [m]."""

    kind: str
    place: tuple[float, float, float]
    energy: float
    radius: float = 0.1


@dataclass(frozen=True)
class Case:
    """A scene that both programs bake.

    Parameters
    ----------
    name : str
    title : str
    builder : "cornell", "interior", "living-room", "apartment" or "file"
    resolution : int
        Of the one atlas page.
    samples : tuple of int
        Cycles' bakes, three or more.
    reference_samples : int
        Of each of the two references.
    targets : tuple of float
        Errors at which times are compared.
    runs : tuple of dict
        Our bakes: `BakeSettings` by name; "solver" and "gather" hold what differs from the quality's presets.
    parameters : dict
        What the builder takes.
    path : str or None
        Below the shared scenes.
    lamp : Lamp or None
    sky : tuple of 3 float or None
        Radiance to light a scene with [W/m²/sr].
    minutes : float
        After which a bake of ours or Cycles' is given up.
    smart_uvs : bool
        Whether Blender's Smart UV Project lays out the page, whose few large islands suit a denoiser.
    """

    name: str
    title: str
    builder: str
    resolution: int
    samples: tuple[int, ...]
    reference_samples: int
    targets: tuple[float, ...] = (0.03, 0.02, 0.01)
    runs: tuple[dict[str, Any], ...] = QUALITIES
    parameters: dict[str, Any] = field(default_factory=dict)
    path: str | None = None
    lamp: Lamp | None = None
    sky: tuple[float, float, float] | None = None
    minutes: float = 20.0
    smart_uvs: bool = False

    @property
    def file(self) -> Path | None:
        """The scene's file, where it is one."""
        return None if self.path is None else SHARED_SCENES / self.path

    @property
    def missing(self) -> str | None:
        """Why it cannot be run here, None if it can."""
        if self.file is None or self.file.is_file():
            return None
        return f"{self.file} is not here"

    def key(self) -> str:
        """Return what changes whenever the prepared scene must: a folder name for the cache."""
        sources = {
            "cornell": [ROOT / "radiosity_addon" / "blender" / "files" / "cornell.py"],
            "file": [ROOT / "bench" / "flatten.py"],
        }.get(self.builder, sorted((ROOT / "bench" / "interior").glob("*.py")))
        digest = hashlib.sha256()
        for source in sources:
            # Without comments and line breaks, which change no scene.
            digest.update(ast.dump(ast.parse(source.read_text(encoding="utf-8"))).encode())
        if self.file is not None:
            digest.update(str(self.file.stat().st_size).encode())
        about = [CONTENTS, self.resolution, self.parameters, self.path, self.sky, blender_version()]
        about.append(
            None
            if self.lamp is None
            else [self.lamp.kind, self.lamp.place, self.lamp.energy, self.lamp.radius]
        )
        if self.smart_uvs:
            about.append("smart, soups welded")
        digest.update(json.dumps(about, sort_keys=True).encode())
        return f"{self.name}-{self.resolution}-{digest.hexdigest()[:12]}"


def blender_version() -> str:
    """Return the version of Blender's module."""
    try:
        return version("bpy")
    except PackageNotFoundError:
        return "none"


def _file(name: str, title: str, path: str, **more: Any) -> Case:
    settings: dict[str, Any] = {"samples": (16, 64, 256), "reference_samples": 256, "resolution": 512, **more}
    return Case(name=name, title=title, builder="file", path=path, **settings)


_BOXES_LAMP = Lamp("POINT", (0.0, -1.5, 4.0), 150.0)

CASES = {
    case.name: case
    for case in (
        Case("cornell", "Cornell box", "cornell", 256, (16, 64, 256, 1024), 2048),
        Case("interior", "Office", "interior", 512, (4, 16, 64), 256),
        Case("living-room", "Living room under a sky image", "living-room", 512, (16, 64, 256), 256),
        Case("apartment", "Apartment, sun and sky", "apartment", 512, (16, 64, 256), 256),
        _file("staircase", "The Wooden Staircase (Wig42)", "staircase/staircase.blend"),
        _file("classroom", "Japanese Classroom (NovaZeeke), matte", "classroom/classroom-matte.blend"),
        Case("apartment-smart", "Apartment on Smart UVs", "apartment", 512, (16, 64, 256), 256,
             smart_uvs=True),
        _file("classroom-smart", "Japanese Classroom on Smart UVs", "classroom/classroom-matte.blend",
              smart_uvs=True),
        _file("sponza", "Sponza (Dabrovic)", "sponza/sponza.blend"),
        _file("bevy-mixed", "Mixed lighting (Bevy)", "bevy-mixed/MixedLightingExample.gltf"),
        _file("platformer", "Platformer (Armory)", "platformer/platformer.blend"),
        _file("game-map", "Game map zdm2 (Calinou)", "game-map/zdm2.obj", sky=(1.0, 1.0, 1.0)),
        _file("boxes", "Abutting boxes (Godot tests)", "godot-tests/test01/boxes.blend",
              lamp=_BOXES_LAMP, resolution=256),
        _file("leaks", "Thin walls (Godot tests)", "godot-tests/test03/leaks.blend",
              lamp=Lamp("POINT", (15.0, 10.0, 4.0), 300.0), resolution=256),
    )
}  # fmt: skip

_FEW_LINKS = ({"quality": "draft", "max_links": 100_000},)
_SMALL: dict[str, Any] = {"runs": _FEW_LINKS, "minutes": 6.0}
SMALL_CASES = {
    case.name: case
    for case in (
        Case("cornell", "Cornell box", "cornell", 48, (2, 8, 32), 64, runs=QUALITIES[1:3], minutes=6.0),
        Case("interior", "Office", "interior", 64, (1, 2, 4), 16, parameters={"detail": 0.1}, **_SMALL),
        _file("boxes", "Abutting boxes (Godot tests)", "godot-tests/test01/boxes.blend",
              lamp=_BOXES_LAMP, resolution=48, samples=(1, 4, 16), reference_samples=64, **_SMALL),
    )
}  # fmt: skip

ROOM_SIZES = (1_000, 10_000, 100_000, 1_000_000)
SMALL_ROOM_SIZES = (100, 300, 1_000)
ROOMS = "rooms"


def with_asked_errors(case: Case) -> tuple[dict[str, Any], ...]:
    """Return our bakes of a case, and those to a target error."""
    if ERROR_SETTING is None:
        return case.runs
    return (*case.runs, *({ERROR_SETTING: error} for error in ASKED_ERRORS))


def label(run: dict[str, Any]) -> str:
    """Name one of our bakes."""
    parts = [run["quality"]] if "quality" in run else []
    for name, value in run.items():
        if name in ("solver", "gather"):
            parts += [f"{key} {item:g}" for key, item in value.items() if isinstance(item, int | float)]
        elif name != "quality":
            parts.append(f"error {value:g}" if name == ERROR_SETTING else f"{name} {value}")
    return ", ".join(parts)
