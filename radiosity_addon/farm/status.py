"""What of a spool's bake is done."""

from __future__ import annotations

from contextlib import suppress

from .objects import ObjectError
from .spool import Spool
from .tasks import task_count


def status_lines(spool: Spool) -> list[str]:
    """Return what there is to say of a spool, a line each."""
    if spool.is_over():
        return ["the bake has ended"]
    digest = spool.open_call()
    if digest is None:
        return ["the bake computes what is not shared, or has not started"]
    try:
        call = spool.call(digest)
        kernel = call["kernel"]["partial"][0]["function"]
        total = task_count(len(call["slices"]))
    except (ObjectError, KeyError, TypeError, IndexError) as error:
        return [f"the call that waits cannot be read: {error}"]
    done, claimed = spool.done(digest), spool.claimed(digest)
    return [
        f"{kernel}: {len(done)} of {total} tasks done, {len(claimed - done)} begun",
        f"{_megabytes(spool, 'arrays/*', 'objects/*')} MB of inputs, "
        f"{_megabytes(spool, 'calls/*/*.result')} MB of results",
    ]


def _megabytes(spool: Spool, *patterns: str) -> str:
    """Return the size of files in the spool."""
    size = 0
    for pattern in patterns:
        for path in spool.path.glob(pattern):
            with suppress(OSError):
                size += path.stat().st_size
    return f"{size / 1e6:.1f}"
