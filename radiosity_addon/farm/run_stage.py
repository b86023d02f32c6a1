"""The command `run`: the stage of a prepared bake that needs no Blender."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from ..base import in_thread
from ..cli import Console, FarmSpec, Interrupts, run_through
from .helper_choice import wanted_helpers
from .prepared import BakeInputs, prepared_in
from .spool import Spool
from .stages import bake_prepared, finished_into
from .stored_result import StoredResult, forget_result


def run(path: Path, farm: FarmSpec | None, console: Console, interrupts: Interrupts) -> None:
    """Bake what was prepared in a spool, unless its result is there.

    Raises RadiosityError if nothing is prepared, or the bake fails.
    """
    spool = Spool.to_work(path)
    into = finished_into(spool)
    if into is not None:
        console.lines([f"the bake was finished into '{into}': there is nothing to run"])
        return
    prepared = prepared_in(spool)
    console.progress("read", 0.0)
    inputs = BakeInputs.read(spool, prepared.inputs)
    if StoredResult.is_whole(spool, prepared.inputs, inputs.bake_scene, inputs.settings):
        console.lines([f"the result is in '{spool.path}' already: there is nothing to run; finish it"])
        return
    with wanted_helpers(farm) as helpers:
        spool = Spool.to_bake(path)
        forget_result(spool, prepared.inputs)
        try:
            job = in_thread(partial(bake_prepared, spool, prepared.inputs, inputs, helpers), False)
            run_through(job, console, interrupts)
        finally:
            spool.leave()
    console.lines([f"the result is in '{spool.path}': finish it with `finish SCENE --spool {spool.path}`"])
