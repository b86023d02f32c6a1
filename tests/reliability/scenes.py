"""`python -m tests.reliability.scenes --seeds A:B`: random scenes in worker processes, with a time limit.

`--here` makes the trials in this process instead, to look for the cause of a failure.
"""

from __future__ import annotations

import argparse
import json
import os
import select
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from .command import ROOT
from .tally import Tally

SECONDS = 120.0
"""For a scene."""

PER_WORKER = 60
"""Scenes, after which a process is replaced: what leaks is not met by the next ones."""

WORKER = "import sys; from tests.reliability.scenes import work; work(int(sys.argv[1]), sys.argv[2])"


class _Worker:
    """A process that makes one trial at a time."""

    def __init__(self) -> None:
        self.folder = tempfile.TemporaryDirectory(prefix="radiosity-reliability-")
        self.seed: int | None = None
        self.made = 0
        read, write = os.pipe()
        self.process = subprocess.Popen(
            [sys.executable, "-c", WORKER, str(write), self.folder.name],
            cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": self.folder.name},
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            pass_fds=(write,), start_new_session=True,
        )  # fmt: skip
        os.close(write)
        self.answers = os.fdopen(read)
        self.until = 0.0

    def give(self, seed: int) -> None:
        assert self.process.stdin is not None
        self.seed, self.until = seed, time.monotonic() + SECONDS
        self.made += 1
        self.process.stdin.write(f"{seed}\n".encode())
        self.process.stdin.flush()

    def end(self) -> int:
        """End the process; returns its exit code."""
        code = self.process.poll()
        self.process.kill()
        self.process.wait()
        self.answers.close()
        self.folder.cleanup()
        return 0 if code is None else code


def run_all(tally: Tally, seeds: Iterable[int], workers: int = 2) -> None:
    """Make the trials that have not been made."""
    waiting = [seed for seed in seeds if not tally.done(seed)]
    waiting.reverse()
    busy: list[_Worker] = []
    try:
        while waiting or busy:
            while waiting and len(busy) < workers:
                busy.append(_Worker())
                busy[-1].give(waiting.pop())
            ready, _, _ = select.select([worker.answers for worker in busy], [], [], 1.0)
            for worker in list(busy):
                answer = worker.answers.readline() if worker.answers in ready else ""
                if answer:
                    _note(tally, worker.seed, json.loads(answer))
                    if waiting and worker.made < PER_WORKER:
                        worker.give(waiting.pop())
                        continue
                elif worker.process.poll() is not None:
                    code = worker.process.poll()
                    tally.add(worker.seed, "crashed", [f"the process ended with code {code}"])
                elif time.monotonic() > worker.until:
                    tally.add(worker.seed, "stopped", [f"took more than {SECONDS:.0f} s"])
                else:
                    continue
                busy.remove(worker)
                worker.end()
    finally:
        for worker in busy:
            worker.end()


def _note(tally: Tally, seed: int | None, answer: dict[str, Any]) -> None:
    tally.add(seed, answer["outcome"], answer["problems"], **{k: answer[k] for k in ("seconds", "measures")})


def work(answers: int, folder: str) -> None:
    """Make the trials whose seeds come by the standard input."""
    import radiosity_addon

    radiosity_addon.register()
    with os.fdopen(answers, "w") as file:
        for line in sys.stdin:
            file.write(json.dumps(one(int(line), Path(folder) / "scene")) + "\n")
            file.flush()
    os._exit(0)


def one(seed: int, folder: Path) -> dict[str, Any]:
    """Make the trial of a seed; whatever is raised is a problem."""
    import traceback

    from .trial import try_seed

    began = time.process_time()
    try:
        outcome, problems, measures = try_seed(seed, folder)
    except Exception:  # noqa: BLE001 (whatever it is, it is what we look for)
        outcome, problems, measures = "raised", [traceback.format_exc()[-1500:]], {}
    seconds = round(time.process_time() - began, 2)
    return {"outcome": outcome, "problems": problems, "measures": measures, "seconds": seconds}


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.reliability.scenes", description=__doc__)
    parser.add_argument("--seeds", default="0:20", metavar="A:B", help="from A to B − 1")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--here", action="store_true")
    asked = parser.parse_args()
    first, _, last = asked.seeds.partition(":")
    seeds = range(int(first), int(last or int(first) + 1))
    tally = Tally("scenes", None)
    if asked.here:
        import radiosity_addon

        radiosity_addon.register()
        with tempfile.TemporaryDirectory() as folder:
            for seed in seeds:
                answer = one(seed, Path(folder) / "scene")
                _note(tally, seed, answer)
                sys.stderr.write(f"{seed}: {answer}\n")
    else:
        run_all(tally, seeds, asked.workers)
    return tally.finish()


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)
