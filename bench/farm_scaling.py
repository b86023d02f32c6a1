"""What many workers would gain: `python3 -m bench.farm_scaling`.

One bake of the office is recorded while it is shared, without workers: processor seconds of each task, of
what lies between calls, of reading what workers read and of taking up results, and the bytes that are moved.
From these the bake's time with 1 to 1,000 workers is simulated, as `farm/` gives tasks away.
"""

from __future__ import annotations

import argparse
import heapq
import json
import tempfile
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any
from weakref import WeakValueDictionary

from radiosity_addon.farm import Spool, shared_bake
from radiosity_addon.farm.tasks import read_kernel, values_of
from radiosity_addon.farm.worker import KEPT_CALLS

from . import pictures
from .compare import say
from .report import context, write

WORKERS = (0, 1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1000)

RESULTS = Path(__file__).parent / "results"


@dataclass(frozen=True)
class Call:
    """A kernel's call; all times are processor seconds of one core.

    before: Of what the bake computes between the call before and this one, publishing included.
    read: Of a worker, to read what it has not read before.
    tasks: Of each task, in the order in which they are claimed.
    take: Of the bake, to read each task's result.
    input_bytes: That are new to all workers.
    result_bytes: Of each task.
    """

    kernel: str
    before: float
    read: float
    tasks: tuple[float, ...]
    take: tuple[float, ...]
    input_bytes: int
    result_bytes: tuple[int, ...]


@dataclass(frozen=True)
class Costs:
    """What sharing costs besides tasks.

    look: Seconds between looks of workers that wait: they see a call spread evenly over this time.
    seconds_per_byte: Of the machine that has the spool, to all others together: 10 Gbit/s.
    read, take: Parts of the measured seconds for reading inputs and results.
    """

    look: float = 0.1
    seconds_per_byte: float = 8 / 10e9
    read: float = 1.0
    take: float = 1.0


class RecordingSpool(Spool):
    """A spool that notes what its bake costs, and what it would cost workers."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.rows: list[dict[str, Any]] = []
        # As workers do.
        self._known: WeakValueDictionary[str, Any] = WeakValueDictionary()
        self._kept: deque[Any] = deque(maxlen=KEPT_CALLS)
        self._worker: Spool | None
        self._digest, self._worker = "", None
        self._opened = self._closed = time.process_time()

    def put_call(self, text: str) -> str:
        self._digest = super().put_call(text)
        self._opened = time.process_time()
        self.rows.append({"before": self._opened - self._closed})
        return self._digest

    def close_call(self) -> None:
        super().close_call()
        digest, self._digest = self._digest, ""
        if not digest:
            return
        row, now = self.rows[-1], time.process_time()
        row["whole"] = now - self._opened
        self._worker = self._worker or Spool.to_work(self.path)
        now = time.process_time()
        self._kept.append(read_kernel(self._worker, digest, self._known))
        row["read"] = time.process_time() - now
        row["take"] = []
        for task in range(len(self.done(digest))):
            now = time.process_time()
            values_of(*(self.result(digest, task) or ({}, [])))
            row["take"].append(time.process_time() - now)
        self._closed = time.process_time()

    def tail(self) -> float:
        """Return the processor seconds since the last call."""
        return time.process_time() - self._closed


def record(resolution: int, quality: str) -> dict[str, Any]:
    """Bake the office alone, and shared without workers; return what each part of it takes."""
    from radiosity_addon.bake.pipeline import bake
    from radiosity_addon.options.bake_settings import BakeSettings

    from .incremental import office

    scene, _, _ = office()
    settings = BakeSettings(resolution=resolution, quality=quality, threads=1)
    started = time.process_time()
    bake(scene, settings)
    alone = time.process_time() - started
    say(f"alone: {alone:.1f} s")
    with tempfile.TemporaryDirectory() as folder:
        spool = RecordingSpool.to_bake(Path(folder) / "spool")
        assert isinstance(spool, RecordingSpool)
        with shared_bake(spool) as shared:
            bake(scene, settings)
            tail = spool.tail()
    calls = []
    for row, of in zip(spool.rows, shared.calls, strict=True):
        between = row["before"] + max(row["whole"] - sum(of.seconds), 0.0)
        calls.append(
            Call(
                of.kernel,
                between,
                row["read"],
                tuple(of.seconds),
                tuple(row["take"]),
                of.input_bytes,
                tuple(of.result_bytes),
            )
        )
    return {"alone": alone, "calls": [asdict(call) for call in calls], "tail": tail}


def simulated(calls: Sequence[Call], tail: float, workers: int, costs: Costs | None = None) -> float:
    """Return the seconds of a bake with some workers, each on a core of its own, as the bake is."""
    given = costs or Costs()
    return tail + sum(call.before + call_seconds(call, workers, given) for call in calls)


def call_seconds(call: Call, workers: int, costs: Costs) -> float:
    """Return how long a call is open: until the bake has taken up the last result.

    As many workers as there are tasks, those that look first, read the inputs, and share the spool's
    bandwidth. The bake works at tasks as well, and takes up results in order.
    """
    helping = min(workers, len(call.tasks))
    ready = costs.read * call.read + helping * call.input_bytes * costs.seconds_per_byte
    free = [(0.0, 0)]
    free += [(ready + costs.look * (number - 0.5) / workers, number) for number in range(1, helping + 1)]
    heapq.heapify(free)
    taken = 0.0
    for seconds, take, size in zip(call.tasks, call.take, call.result_bytes, strict=True):
        since, who = heapq.heappop(free)
        done = since + seconds
        heapq.heappush(free, (done, who))
        if who == 0:
            taken = max(taken, done)
        else:
            taken = max(taken, done + size * costs.seconds_per_byte) + costs.take * take
    return taken


def explained(calls: Sequence[Call], tail: float) -> dict[str, float]:
    """Return the parts of the time with the most workers, and what it would be without some of them [s]."""
    most, usual = WORKERS[-1], Costs()
    return {
        "not_shared": tail + sum(call.before for call in calls),
        "all_tasks": sum(sum(call.tasks) for call in calls),
        "longest_task_of_each_call": sum(max(call.tasks) for call in calls),
        "all": simulated(calls, tail, most),
        "without_moving": simulated(calls, tail, most, replace(usual, seconds_per_byte=0.0)),
        "without_reading_inputs": simulated(calls, tail, most, replace(usual, read=0.0)),
        "without_reading_results": simulated(calls, tail, most, replace(usual, take=0.0)),
        "without_looking": simulated(calls, tail, most, replace(usual, look=0.0)),
        "without_all_of_these": simulated(calls, tail, most, Costs(0.0, 0.0, 0.0, 0.0)),
    }


def results_of(recorded: dict[str, Any]) -> dict[str, Any]:
    """Return the simulation of what was recorded."""
    calls = [Call(**call) for call in recorded["calls"]]
    rows = []
    for workers in WORKERS:
        seconds = simulated(calls, recorded["tail"], workers)
        rows.append({"workers": workers, "seconds": seconds, "speedup": recorded["alone"] / seconds})
    by_kernel: dict[str, dict[str, Any]] = {}
    for call in calls:
        entry = by_kernel.setdefault(
            call.kernel, {"calls": 0, "tasks": 0, "seconds": 0.0, "longest": 0.0, "input_MB": 0.0}
        )
        entry["calls"] += 1
        entry["tasks"] += len(call.tasks)
        entry["seconds"] += sum(call.tasks)
        entry["longest"] += max(call.tasks)
        entry["input_MB"] += call.input_bytes / 1e6
    return {
        "case": "farm-scaling",
        "alone": recorded["alone"],
        "simulated": rows,
        "with_most": explained(calls, recorded["tail"]),
        "kernels": by_kernel,
        "recorded": recorded,
    }


def main() -> None:
    """Record, simulate, write and draw."""
    parser = argparse.ArgumentParser(prog="python3 -m bench.farm_scaling", description=__doc__)
    parser.add_argument("--resolution", type=int, default=512)
    parser.add_argument("--quality", default="draft")
    parser.add_argument("--again", type=Path, metavar="FILE", help="simulate what another run has recorded")
    parser.add_argument("--output", type=Path, default=RESULTS, metavar="DIR")
    options = parser.parse_args()
    if options.again is None:
        results = results_of(record(options.resolution, options.quality))
        results["settings"] = {"resolution": options.resolution, "quality": options.quality, "threads": 1}
        results["context"] = context(1)
    else:
        earlier = json.loads(options.again.read_text(encoding="utf-8"))
        results = results_of(earlier["recorded"])
        results |= {key: earlier[key] for key in ("settings", "context")}
    path = write(results, options.output)
    if pictures.AVAILABLE:
        pictures.draw_farm(results, path.with_suffix(".png"))
    for row in results["simulated"]:
        say(f"{row['workers']:5} workers: {row['seconds']:6.1f} s, {row['speedup']:.2f}x")
    for name, seconds in results["with_most"].items():
        say(f"{name}: {seconds:.2f} s")


if __name__ == "__main__":
    main()
