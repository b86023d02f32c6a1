"""One measurement: `python -m bench.worker FOLDER` reads FOLDER/job.json and writes FOLDER/result.json."""

from __future__ import annotations

import json
import os
import resource
import sys
import time
import traceback
from pathlib import Path

import numpy as np

from .measure import TASKS


class Others:
    """The load of the machine by other processes, from now on."""

    def __init__(self) -> None:
        self.wall, self.busy, self.own = self._now()

    def cores(self) -> float | None:
        """Return how many cores others kept busy, on average; None where the system does not say."""
        wall, busy, own = self._now()
        if self.busy is None or busy is None:
            return None
        return max(0.0, (busy - self.busy) - (own - self.own)) / (wall - self.wall)

    @staticmethod
    def _now() -> tuple[float, float | None, float]:
        """Return wall-clock time, all processors' busy time and this process's [s]."""
        try:
            ticks = [int(word) for word in Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:]]
        except (OSError, ValueError):
            return time.perf_counter(), None, time.process_time()
        # user, nice, system, idle, iowait, irq, softirq
        busy = (sum(ticks[:3]) + sum(ticks[5:7])) / os.sysconf("SC_CLK_TCK")
        return time.perf_counter(), busy, time.process_time()


def main(folder: Path) -> int:
    job = json.loads((folder / "job.json").read_text())
    others = Others()
    result = TASKS[job["task"]](job)
    result["busy_elsewhere"] = others.cores()
    # Linux counts in KiB, macOS in bytes.
    unit = 2**20 if sys.platform == "darwin" else 2**10
    result["memory_MB"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit
    text = json.dumps(result, default=lambda value: np.asarray(value).tolist())
    (folder / "result.json").write_text(text)
    return 0


if __name__ == "__main__":
    code = 1
    try:
        code = main(Path(sys.argv[1]))
    except Exception:  # noqa: BLE001 - whatever it is, the runner shows it
        traceback.print_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)  # some versions of Blender's module hang or crash at the interpreter's own exit
