"""What of a spool's bake is done."""

from __future__ import annotations

from contextlib import suppress

from .objects import ObjectError
from .prepared import PreparedBake
from .signs import baker
from .spool import Spool
from .stages import Stage, finished_into, stage_of
from .tasks import task_count

NOBODY = "no bake goes on here: one that is started with this spool goes on with what it holds"


def status_lines(spool: Spool) -> list[str]:
    """Return what there is to say of a spool, a line each.

    Raises BakeError if a bake that was prepared there is damaged.
    """
    stage = stage_of(spool)
    if stage is None:
        return _of_bake(spool)
    return [*_of_stage(spool, stage), *(_of_bake(spool) if stage in ("running", "interrupted") else ())]


def _of_stage(spool: Spool, stage: Stage) -> list[str]:
    prepared = PreparedBake.read(spool)
    into = finished_into(spool)
    if into is not None:
        return [f"{stage}, into '{into}'"]
    assert prepared is not None
    return [f"{stage}: scene '{prepared.scene}' of '{prepared.source}'"]


def _of_bake(spool: Spool) -> list[str]:
    if spool.is_over():
        return ["the bake has ended"]
    who, digest = baker(spool.sign), spool.open_call()
    if who is None:
        return [NOBODY, _sizes(spool)]
    if digest is None:
        host, number = who
        return [f"process {number} on {host} computes what is not shared", _sizes(spool)]
    try:
        call = spool.call(digest)
        kernel = call["kernel"]["partial"][0]["function"]
        total = task_count(len(call["slices"]))
    except (ObjectError, KeyError, TypeError, IndexError) as error:
        return [f"the call that waits cannot be read: {error}"]
    done, claimed = spool.done(digest), spool.claimed(digest)
    return [f"{kernel}: {len(done)} of {total} tasks done, {len(claimed - done)} begun", _sizes(spool)]


def _sizes(spool: Spool) -> str:
    """Return how much is kept."""
    inputs = _megabytes(spool, "arrays/*", "objects/*")
    results = _megabytes(spool, "calls/*/*.result")
    return f"{inputs} MB of inputs, {results} MB of results"


def _megabytes(spool: Spool, *patterns: str) -> str:
    """Return the size of files in the spool."""
    size = 0
    for pattern in patterns:
        for path in spool.path.glob(pattern):
            with suppress(OSError):
                size += path.stat().st_size
    return f"{size / 1e6:.1f}"
