"""The verbs `prepare` and `finish`: the stages of a bake that need Blender."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path

import bpy

from ...bake import KeepOptions
from ...base import BakeError
from ...cli import Console, Interrupts, Permissions, run_through
from ...farm import (
    BakeInputs,
    PreparedBake,
    Spool,
    finished_into,
    finishing,
    prepared_in,
    result_in,
    say_finished,
    spool_to_prepare,
    store_prepared,
)
from ...files import REPORT_NAME
from ...options import BakeSettings, Form
from ..exporting.shown_lightmaps import refuse_quantity
from ..jobs.job import prepare_bake
from . import verbs


def prepare(
    scene: Path | None,
    loaded: Path | None,
    spool: Path,
    settings: BakeSettings,
    wanted: PreparedBake,
    allowed: Permissions,
    console: Console,
    interrupts: Interrupts,
) -> None:
    """Write all that a bake of a scene reads into a spool.

    Parameters
    ----------
    scene, loaded, settings, allowed, console, interrupts
        As for `verbs.bake`.
    spool : Path
        The spool's folder.
    wanted : PreparedBake
        What is to become of the result.

    Raises
    ------
    RadiosityError
        If a bake would stop, as far as is known before unwrapping, or the folder cannot be used.
    """
    with verbs.registered(), spool_to_prepare(spool) as into:
        console.progress("open", 0.0)
        verbs.open_or_build(scene, loaded, allowed)
        owner = verbs.command_owner(scene or loaded)
        if wanted.form is not None:
            refuse_quantity(settings.quantity)
        keeping = KeepOptions(sidecar=True) if wanted.keep else None
        job = prepare_bake(bpy.context, settings, keeping)
        planned = run_through(job, console, interrupts)
        console.progress("write", 1.0)
        plan = planned.plan
        inputs = BakeInputs(plan.bake_scene, plan.settings, planned.keeping is not None)
        news = store_prepared(into, inputs, wanted.of(owner.source, owner.scene))
        what = "run it" if news else "its result is there already: finish it"
        console.lines([f"scene '{owner.scene}' is prepared in '{into.path}': {what}"])


def finish(
    scene: Path | None,
    loaded: Path | None,
    output: Path,
    spool: Path,
    report_copy: Path | None,
    plot: Path | None,
    allowed: Permissions,
    console: Console,
    interrupts: Interrupts,
    after: Callable[[Path, Form | None, Permissions, Console, Interrupts], None],
) -> None:
    """Show and publish the result of a bake that was prepared and run, as `verbs.bake` does with its own.

    Parameters
    ----------
    scene, loaded, output, report_copy, plot, allowed, console, interrupts
        As for `verbs.bake`.
    spool : Path
        The spool's folder.
    after : callable
        Exports what was published, in the form that was prepared.

    Raises
    ------
    RadiosityError
        If there is no result, or the scene is not as it was prepared.
    """
    ready = Spool.to_work(spool)
    into = finished_into(ready)
    if into is not None:
        if into != output.expanduser().resolve():
            raise BakeError(f"'{ready.path}' was finished into '{into}': prepare and run the bake again")
        if not (into / REPORT_NAME).is_file():
            raise BakeError(
                f"'{ready.path}' was finished into '{into}', where no {REPORT_NAME} is any more: "
                "prepare and run the bake again"
            )
        say_finished(ready, output)  # which may have been interrupted
        console.lines([f"'{ready.path}' was finished into '{into}' already: there is nothing left to do"])
        return
    prepared = prepared_in(ready)
    stored = result_in(ready, prepared)
    keeping = KeepOptions(sidecar=True, mark=stored.mark or KeepOptions().mark) if prepared.keep else None
    with finishing(ready, prepared, stored, output) as baking:
        verbs.bake(
            scene,
            loaded,
            output,
            prepared.settings,
            report_copy,
            plot,
            keeping,
            allowed,
            console,
            interrupts,
            preview=prepared.preview,
            form=prepared.form,
            baking=nullcontext(baking),
        )
        after(output, prepared.form, allowed, console, interrupts)
