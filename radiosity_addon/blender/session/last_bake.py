"""A scene's memory of its last bake: written after a bake, shown by the panel, dropped by Restore."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import NamedTuple

import bpy

from ...base import one_of_each
from ...options import METHODS
from .state import session
from .turned_faces import TurnedFaces, from_json, to_json

MEMORY = ("last_bake", "baked_light", "baked_objects", "baked_lights", "baked_content")
"""What a scene remembers of its last bake, by the properties of `scene.radiosity`."""

MAX_WARNINGS = 100
"""A scene keeps this many of the last bake's warnings; the report has them all."""


class LastBake(NamedTuple):
    """Figures and warnings of the last bake of a scene."""

    figures: tuple[tuple[str, str], ...] = ()
    warnings: tuple[tuple[str, str], ...] = ()
    """One of each kind where there are many alike."""
    warning_count: int = 0
    folder: str = ""
    notes: tuple[str, ...] = ()
    turned: tuple[TurnedFaces, ...] = ()
    """Faces that the warnings name."""


_parsed: tuple[str, LastBake | None] = "", None
"""The text that was read last, and what it says."""


def remember(scene: bpy.types.Scene, report: dict, folder: str, turned: Sequence[TurnedFaces] = ()) -> None:
    """Keep what the panel shows of a finished bake with the scene.

    Parameters
    ----------
    scene : Scene
    report : dict
        As it is written to report.json.
    folder : str
        Where the files are; empty if they are packed.
    turned : sequence of TurnedFaces
        Faces that its warnings name.
    """
    warnings = one_of_each(report["warnings"])
    scene.radiosity.last_bake = json.dumps(
        {
            "objects": len(report["objects"]),
            "images": len({entry["image"] for entry in report["objects"]}),
            "solver": {key: value for key, value in report["solver"].items() if key != "history"},
            "seconds": sum(report["seconds"].values()),
            "warnings": [[w["name"], w["message"]] for w in warnings[:MAX_WARNINGS]],
            "warning_count": len(warnings),
            "notes": [note["message"] for note in one_of_each(report.get("notes", ()))[:MAX_WARNINGS]],
            "folder": folder,
            "turned": to_json(turned),
        }
    )


def forget(scene: bpy.types.Scene) -> None:
    """Drop the scene's memory of its last bake, and all trace of us where nothing else was set."""
    session.kept_details.pop(scene.name_full, None)
    group = scene.radiosity
    for name in MEMORY:
        group.property_unset(name)
    names = [prop.identifier for prop in group.bl_rna.properties if not prop.is_readonly]
    if not any(map(group.is_property_set, names)):
        scene.property_unset("radiosity")


def read(scene: bpy.types.Scene) -> LastBake | None:
    """Return the last bake of the scene; None if there was none."""
    text = scene.radiosity.last_bake
    if not text:
        return None
    global _parsed
    if text != _parsed[0]:
        _parsed = text, _parse(text)
    return _parsed[1]


def _parse(text: str) -> LastBake | None:
    """Return what `remember` wrote; None for what somebody else put there."""
    try:
        record = json.loads(text)
        solver = record["solver"]
        figures = [
            ("Method", METHODS[solver["method"]].label),
            ("Time", f"{record['seconds']:.1f} s"),
            ("Objects", f"{record['objects']:,}"),
            ("Images", f"{record['images']:,}"),
            ("Elements", f"{solver['elements']:,}"),
            ("Links", f"{solver['links']:,}"),
            ("Rays", f"{solver['rays']:,}"),
        ]
        if solver.get("iterations"):
            figures.append(("Iterations", f"{solver['iterations']:,}"))
        if solver.get("residual") is not None:
            figures.append(("Residual", f"{solver['residual']:.1e}"))
        if len(solver.get("independent_sets", ())) > 1:
            # Parts that exchange no light, such as closed rooms, each solved by itself.
            figures.append(("Separate Parts", f"{len(solver['independent_sets']):,}"))
        power = solver.get("power_W", {})
        if power.get("emitted") and "escaped" in power:
            # All in a closed scene, less where light may leave.
            figures.append(("Light Kept", f"{max(1.0 - power['escaped'] / power['emitted'], 0.0):.1%}"))
        if solver.get("glass"):
            # Objects that light goes straight through.
            figures.append(("Glass", f"{len(solver['glass']):,}"))
        return LastBake(
            figures=tuple(figures),
            warnings=tuple((str(name), str(message)) for name, message in record["warnings"]),
            warning_count=int(record["warning_count"]),
            folder=str(record["folder"]),
            notes=tuple(map(str, record.get("notes", ()))),
            turned=from_json(record.get("turned", ())),
        )
    except (ValueError, KeyError, TypeError):
        return None
