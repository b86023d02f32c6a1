"""The house rules that a linter cannot see: who may import whom, and how long a file may grow."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = "radiosity_addon"

# Each layer may import those after it, front doors any.
LAYERS = ("blender", "pipeline", "lightmap", "solver")
LAYER_OF = {
    **{layer: layer for layer in LAYERS},
    "quality": "pipeline",
    "relighting": "pipeline",
    "light_groups": "pipeline",
    "rebaking": "pipeline",
    "remarks": "pipeline",
    "relight_check": "pipeline",
    "fingerprint": "pipeline",
    "sidecar": "pipeline",
    "sidecar_checks": "pipeline",
    "hierarchy_checks": "pipeline",
    "texture_print": "pipeline",
    "keeping": "pipeline",
    "responses": "pipeline",
    "bake_details": "pipeline",
    "texel_pictures": "pipeline",
    "foresight": "pipeline",
    "texel_memory": "pipeline",
}
FRONT_DOORS = ("", "__main__", "cli", "console", "interrupts")

# Every other module stands beside the layers, for all to import, and knows none of them; only the
# record of a scene names the solver's lamps.
MAY_ALSO_IMPORT = {"bake_scene": ("solver",)}

# What only Blender has belongs to one layer, what is compiled to one file.
HOMES = {
    "bpy": "blender",
    "bmesh": "blender",
    "mathutils": "blender",
    "bpy_extras": "blender",
    "gpu": "blender",
    "blf": "blender",
    "xatlas": "lightmap.chart_process",
    "embreex": "solver.embree",
}

LONGEST_FILE = 400


def module_of(path: Path) -> str:
    """Dotted name below the package: `solver.links`, or `solver` for its __init__."""
    parts = path.relative_to(ROOT / PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports_of(source: str, module: str, is_package: bool) -> Iterator[tuple[int, str]]:
    """(line, what) of every import, wherever it stands; what is ours is named from the package on."""
    parents = f"{PACKAGE}.{module}".rstrip(".").split(".")
    parents = parents if is_package else parents[:-1]
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node.lineno, alias.name
        elif isinstance(node, ast.ImportFrom):
            above = parents[: len(parents) - node.level + 1] if node.level else []
            base = ".".join([*above, *filter(None, [node.module])])
            for alias in node.names:
                yield node.lineno, f"{base}.{alias.name}"


def violation(module: str, imported: str) -> str | None:
    """Why `module` may not import `imported`, None if it may."""
    top, _, rest = imported.partition(".")
    if top in HOMES:
        home = HOMES[top]
        inside = module == home or module.startswith(home + ".")
        return None if inside else f"only {home} may import {top}"
    if top != PACKAGE:
        return None
    layer, target = (LAYER_OF.get(name, name) for name in (module.split(".")[0], rest.split(".")[0]))
    if layer in FRONT_DOORS or target not in (*LAYERS, *FRONT_DOORS):
        return None
    if layer not in LAYERS:
        known = MAY_ALSO_IMPORT.get(layer, ())
        return None if target in known else f"{layer} stands beside the layers and may not import {target}"
    if target in FRONT_DOORS and layer != "blender":
        return f"{layer} may not import the front door {target}"
    if target in LAYERS and LAYERS.index(target) < LAYERS.index(layer):
        return f"{layer} may not import {target}: dependencies point {' → '.join(LAYERS)}"
    return None


def sources() -> list[Path]:
    return sorted((ROOT / PACKAGE).rglob("*.py"))


@pytest.mark.parametrize("path", sources(), ids=lambda path: module_of(path) or PACKAGE)
def test_imports_follow_the_layers(path: Path) -> None:
    module = module_of(path)
    found = imports_of(path.read_text(encoding="utf-8"), module, path.name == "__init__.py")
    broken = [f"line {line}: {why}" for line, what in found if (why := violation(module, what))]
    assert not broken


@pytest.mark.parametrize("path", sources(), ids=lambda path: module_of(path) or PACKAGE)
def test_own_modules_are_imported_relatively(path: Path) -> None:
    # An installed extension's package is not called radiosity_addon.
    names = [
        (node.lineno, name)
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        for name in (
            [alias.name for alias in node.names]
            if isinstance(node, ast.Import)
            else [node.module or ""]
            if isinstance(node, ast.ImportFrom) and node.level == 0
            else []
        )
    ]
    assert not [place for place in names if place[1].split(".")[0] == PACKAGE]


@pytest.mark.parametrize(
    "path",
    [
        *sources(),
        ROOT / "build.py",
        *sorted((ROOT / "build_tools").rglob("*.py")),
        *sorted((ROOT / "tests").rglob("*.py")),
    ],
    ids=lambda path: str(path.relative_to(ROOT)),
)
def test_files_stay_short(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= LONGEST_FILE


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("solver.links", "from ..lightmap import atlas"),
        ("solver.links", "from .. import pipeline"),
        ("lightmap.atlas", "import bpy"),
        ("lightmap.atlas", "from ..blender.export import export_scene"),
        ("lightmap.encode", "def f():\n    import xatlas"),
        ("solver.visibility", "from embreex import rtcore_scene"),
        ("settings", "from .solver import scene"),
        ("pipeline", "from .blender import apply"),
        ("quality", "from .blender import apply"),
        ("solver.solution", "from ..quality import quality_of"),
        ("pipeline", "from .cli import main"),
    ],
)
def test_the_rule_sees_a_wrong_import(module: str, source: str) -> None:
    assert [why for _, what in imports_of(source, module, False) if (why := violation(module, what))]


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("blender.export", "import bpy\nfrom ..solver import scene\nfrom ..pipeline import bake"),
        (
            "lightmap.chart_process",
            "import xatlas\nfrom ..solver.scene import Scene\nfrom ..errors import BakeError",
        ),
        ("solver.embree", "from embreex import rtcore_scene\nimport numpy as np"),
    ],
)
def test_the_rule_lets_right_imports_be(module: str, source: str) -> None:
    assert not [why for _, what in imports_of(source, module, False) if (why := violation(module, what))]
