"""A bake of which is kept what lights it anew, if that is asked for: in memory, or in a sidecar."""

from __future__ import annotations

import uuid
from dataclasses import dataclass, field
from pathlib import Path

from ..base import SILENT, Progress
from ..options import BakeSettings
from ..scene import BakeScene
from .pipeline import bake, bake_and_keep
from .rebaking import bake_moved, can_move
from .relight import KeptBake
from .result import BakeResult
from .sidecar import write_sidecar


@dataclass(frozen=True)
class KeepOptions:
    """How a bake is kept.

    Attributes
    ----------
    sidecar : bool
        Whether it is written to a file beside its lightmaps.
    mark : str
        The bake's own name, by which its images and its sidecar are known to belong together.
    earlier : KeptBake or None
        A kept bake of the same scene: if only places of objects have changed since, just what they touch
        is baked anew.
    """

    sidecar: bool = False
    mark: str = field(default_factory=lambda: uuid.uuid4().hex)
    earlier: KeptBake | None = field(default=None, repr=False, compare=False)


def can_keep(settings: BakeSettings) -> bool:
    """Tell whether bakes of these settings can be lit anew."""
    return settings.method == "hierarchical" and settings.quantity != "residual"


def moves_alone(bake_scene: BakeScene, settings: BakeSettings, keeping: KeepOptions | None) -> bool:
    """Tell whether all that a bake has to do is to follow what moved since an earlier one that was kept."""
    earlier = None if keeping is None else keeping.earlier
    return earlier is not None and can_move(earlier, bake_scene, settings)


def run_pipeline(
    bake_scene: BakeScene,
    settings: BakeSettings,
    keeping: KeepOptions | None,
    sidecar: Path | None,
    progress: Progress = SILENT,
) -> tuple[BakeResult, KeptBake | None]:
    """Bake, and keep the bake if that is asked for.

    Parameters
    ----------
    keeping : KeepOptions or None
    sidecar : Path or None
        Where its file goes, to be published with the bake; None writes none.

    Raises
    ------
    RadiosityError
        Those of `bake_and_keep` and `write_sidecar`.
    """
    if keeping is None:
        return bake(bake_scene, settings, progress), None
    if keeping.earlier is not None and moves_alone(bake_scene, settings, keeping):
        result, kept = bake_moved(keeping.earlier, bake_scene, progress)
    else:
        result, kept = bake_and_keep(bake_scene, settings, progress)
    if sidecar is not None:
        progress.stage("sidecar", 1.0, 1.0).at(1.0)
        write_sidecar(sidecar, kept, result, keeping.mark)
    return result, kept
