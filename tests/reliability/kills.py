"""Bakes killed at random moments: nothing foreign is touched, and the next bake goes as if nothing had been.

Two thirds of the processes end before a random call that concerns the output folder or the temporary folder,
most of them while they publish; the others after a random time.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from random import Random

from . import folders
from .command import bad_manners
from .sandbox import Sandbox
from .tally import Tally

COUNT = 200


def run_all(tally: Tally, root: Path, count: int = COUNT, seed: int = 0) -> None:
    """Make so many trials."""
    sandbox = Sandbox(root)
    sandbox.make()
    temporary = folders.tree(sandbox.temporary)
    calls, seconds = _measure(sandbox)
    for number in range(count):
        if tally.done(number):
            continue
        random = Random(f"{seed}/{number}")
        if random.random() < 0.2:
            sandbox.make()  # one that has no earlier result
        outcome, problems = _trial(sandbox, random, calls, seconds, number + 1)
        left = folders.changes(temporary, folders.tree(sandbox.temporary))
        tally.add(number, outcome, [*problems, *(f"left: {line}" for line in left)])
        if problems or left:
            sandbox.make()


def _measure(sandbox: Sandbox) -> tuple[int, float]:
    """Return how many calls a bake over an earlier result makes, and how long it takes."""
    assert sandbox.bake("--keep").code == 0
    log = sandbox.root / "calls.log"
    hook = f"from tests.reliability.hooks import count_into; count_into({str(log)!r}, *{_watched(sandbox)!r})"
    done = sandbox.bake("--keep", hook=hook)
    assert done.code == 0, done.err
    calls = len(log.read_text(encoding="utf-8").splitlines())
    log.unlink()
    return calls, done.seconds


def _watched(sandbox: Sandbox) -> tuple[str, str]:
    return str(sandbox.out), str(sandbox.temporary)


def _trial(sandbox: Sandbox, random: Random, calls: int, seconds: float, seed: int) -> tuple[str, list[str]]:
    """Kill a bake, look at what is left, and bake again."""
    foreign = sandbox.foreign()
    old = {name: entry["sha256"] for name, entry in folders.listed(sandbox.out).items()}
    words = ("--keep", "--seed", seed)
    if random.random() < 2 / 3:
        call = random.randint(calls // 3, calls) if random.random() < 0.8 else random.randint(1, calls)
        hook = f"from tests.reliability.hooks import kill_at; kill_at({call}, *{_watched(sandbox)!r})"
        killed, moment = sandbox.bake(*words, hook=hook), f"call {call}"
    else:
        limit = random.uniform(0.2, 1.1) * seconds
        killed, moment = sandbox.bake(*words, seconds=limit), f"{limit:.2f} s"
    problems = folders.changes(foreign, sandbox.foreign())
    state = _state(sandbox, old)
    if state == "lost":
        problems.append("the earlier result is lost")
    again = sandbox.bake("--keep", "--seed", seed)
    problems += bad_manners(again)
    if again.code != 0:
        problems.append(f"the next bake fails: {again.err.strip()[-200:]}")
    problems += folders.broken_result(sandbox.out)
    problems += folders.changes(foreign, sandbox.foreign())
    problems += [f"left: {path}" for path in folders.leftovers(sandbox.out) if "blender_mine" not in path]
    ended = "ended by itself" if killed.code == 0 else "killed"
    return f"{ended}, {state}", [f"{moment}: {problem}" for problem in problems]


def _state(sandbox: Sandbox, old: dict[str, str]) -> str:
    """Tell what result there is: none, the old one, a new one, or parts of both."""
    here = {
        path.name: hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sandbox.out.iterdir()
        if path.is_file()
    }
    if old and all(here.get(name) == digest for name, digest in old.items()):
        return "old whole"
    if not folders.reports(sandbox.out):
        return "none" if not old else "lost"
    if not folders.broken_result(sandbox.out):
        return "new whole"
    kept = {hashlib.sha256(p.read_bytes()).hexdigest() for p in sandbox.out.rglob("*") if p.is_file()}
    return "to be recovered" if set(old.values()) <= kept else "lost"
