"""The stages of a bake: Blender prepares and finishes it, any process with the array rooms runs it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Literal

from ..bake import BakePlan, Baking, KeepOptions, plan_bake
from ..bake.relight import KeptBake
from ..bake.result import BakeResult
from ..bake.scene_diff import Part, compare, scene_record
from ..bake.sidecar import sidecar_entry
from ..base import SILENT, BakeError, Progress
from ..numerics import ArrayFileError
from .executor import shared_bake
from .helpers import Helpers
from .pipeline_sharing import shared_pipeline
from .prepared import UNREADABLE, BakeInputs, PreparedBake
from .signs import giving_signs, other_baker, refuse_second_bake
from .spool import BEGUN, FINISHED, PREPARED, Spool
from .spool_store import explained
from .stored_result import StoredResult, has_result, write_result

MOST_PATH = 4096
"""Bytes of a path."""

Stage = Literal["prepared", "running", "interrupted", "ready to finish", "finished"]


def stage_of(spool: Spool) -> Stage | None:
    """Return the stage of the bake that was prepared in a spool; None if none was.

    Raises BakeError if what was prepared is damaged.
    """
    if finished_into(spool) is not None:
        return "finished"
    prepared = PreparedBake.read(spool)
    if prepared is None:
        return None
    if has_result(spool, prepared.inputs):
        return "ready to finish"
    if other_baker(spool.sign) is not None:
        return "running"
    return "interrupted" if spool.pointer(BEGUN) == prepared.inputs else "prepared"


def store_prepared(spool: Spool, inputs: BakeInputs, prepared: PreparedBake) -> bool:
    """Write a bake's inputs into a spool, and what is to become of it; return whether it must be run.

    prepared: `inputs` is filled in here.
    Raises BakeError if another process bakes there, or the spool cannot be written to.
    """
    digest = inputs.write(spool)
    refuse_second_bake(spool.sign)
    with explained(spool.path), suppress(FileNotFoundError):
        (spool.path / FINISHED).unlink()
    replace(prepared, inputs=digest).write(spool)
    if StoredResult.is_whole(spool, digest, inputs.bake_scene, inputs.settings):
        return False
    spool.reopen()
    return True


def bake_prepared(
    spool: Spool, digest: str, inputs: BakeInputs, helpers: Helpers | None, progress: Progress = SILENT
) -> None:
    """Run the pipeline, shared with workers of its spool, and write what it finds there.

    digest: Of the inputs.
    Raises RadiosityError: Those of `run_pipeline`, and if the spool cannot be written to.
    """
    keeping = KeepOptions(sidecar=True) if inputs.keep else None
    plan = plan_bake(inputs.bake_scene, inputs.settings, None, None)
    spool.point(BEGUN, digest)
    baking = shared_pipeline(partial(shared_bake, spool, helpers, emptied=False))
    with nullcontext() if keeping is None else spool.aside() as sidecar:
        result, kept = baking(plan, keeping, sidecar, progress)
        del kept
        write_result(spool, digest, result, "" if keeping is None else keeping.mark, sidecar)


@contextmanager
def finishing(spool: Spool, prepared: PreparedBake, stored: StoredResult, output: Path) -> Iterator[Baking]:
    """Yield what takes the pipeline's place where a prepared bake is finished into a folder.

    If that ends well, the spool is emptied.
    Raises BakeError if another process bakes there, or the spool cannot be written to.
    """
    refuse_second_bake(spool.sign)
    spool.take()
    try:
        with giving_signs(spool.sign):
            yield partial(_known, spool, prepared, stored)
        say_finished(spool, output)
    finally:
        spool.leave()


def finished_into(spool: Spool) -> Path | None:
    """Return the folder that the bake of a spool was finished into; None if it was not."""
    path = spool.path / FINISHED
    with suppress(OSError, ValueError):
        if path.is_file():
            with path.open("rb") as file:
                return Path(file.read(MOST_PATH).decode())
    return None


def say_finished(spool: Spool, output: Path) -> None:
    """Note where a spool's bake was finished, and empty the spool. May be done again.

    Raises BakeError if the spool cannot be written to.
    """
    spool.note(FINISHED, str(output.expanduser().resolve()))
    for name in (PREPARED, BEGUN):
        with explained(spool.path), suppress(FileNotFoundError):
            (spool.path / name).unlink()
    spool.end()


def _known(
    spool: Spool,
    prepared: PreparedBake,
    stored: StoredResult,
    plan: BakePlan,
    keeping: KeepOptions | None,
    sidecar: Path | None,
    progress: Progress = SILENT,
) -> tuple[BakeResult, KeptBake | None]:
    """Return the result of a bake that was run: see `Baking`.

    Raises BakeError if it is not of this plan, or damaged.
    """
    progress.stage("read", 0.0, 1.0).at(0.0)
    inputs = BakeInputs(plan.bake_scene, plan.settings, keeping is not None)
    if inputs.digest() != prepared.inputs:
        what, source = _changes(spool, prepared, inputs), prepared.source
        imported = not source.startswith("<") and not source.lower().endswith(".blend")
        # Blender 5.0 orders the corners of an .obj's faces differently from time to time if some are double.
        advice = ", or if it was not changed, save it as a .blend first" if imported else ""
        raise BakeError(
            f"the scene is not as it was prepared from '{source}'{what}: prepare and run it again{advice}"
        )
    try:
        result = stored.result(plan.bake_scene, plan.settings)
    except UNREADABLE as error:
        raise damaged_result(spool) from error
    if sidecar is not None:
        stored.write_sidecar(sidecar)
        try:
            sidecar_entry(sidecar, "")
        except ArrayFileError as error:
            raise damaged_result(spool) from error
    progress.stage("read", 1.0, 1.0).at(1.0)
    return result, None


def _changes(spool: Spool, prepared: PreparedBake, now: BakeInputs) -> str:
    """Say what differs from what was prepared, if that can be told."""
    with suppress(*UNREADABLE):
        before = BakeInputs.read(spool, prepared.inputs)
        diff = compare(scene_record(before.bake_scene), scene_record(now.bake_scene))
        for part in Part:
            if diff[part]:
                return f" ({part.value.format(diff[part][0])})"
    return ""


def result_in(spool: Spool, prepared: PreparedBake) -> StoredResult:
    """Return the result of the bake that was prepared in a spool.

    Raises BakeError if it was not run yet, or its result is damaged.
    """
    if not has_result(spool, prepared.inputs):
        raise BakeError(f"the bake in '{spool.path}' has no result yet: run it first (`run {spool.path}`)")
    try:
        return StoredResult.read(spool, prepared.inputs)
    except UNREADABLE as error:
        raise damaged_result(spool) from error


def damaged_result(spool: Spool) -> BakeError:
    """Return the error for a result that cannot be read."""
    return BakeError(f"the result in '{spool.path}' is damaged: run the bake again (`run {spool.path}`)")
