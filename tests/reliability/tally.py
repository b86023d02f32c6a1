"""What was tried and what went wrong: a line of JSON each, so that a run can go on where it stopped."""

from __future__ import annotations

import json
import sys
from collections import Counter
from pathlib import Path
from typing import Any


class Tally:
    """The outcomes of a kind of trial, in a file.

    Parameters
    ----------
    name : str
    path : Path or None
        Where outcomes are kept; None keeps them in memory alone.
    """

    def __init__(self, name: str, path: Path | None) -> None:
        self.name, self.path = name, path
        self.entries: dict[str, dict[str, Any]] = {}
        if path is not None and path.exists():
            for line in path.read_text(encoding="utf-8").splitlines():
                entry = json.loads(line)
                self.entries[entry["trial"]] = entry

    def done(self, trial: object) -> bool:
        """Whether a trial was made already."""
        return str(trial) in self.entries

    def add(self, trial: object, outcome: str, problems: list[str], **more: Any) -> None:
        """Add what became of a trial: a word for how it ended, and what was wrong with it."""
        entry = {"trial": str(trial), "outcome": outcome, "problems": problems, **more}
        self.entries[str(trial)] = entry
        if self.path is not None:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with self.path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(entry, ensure_ascii=False) + "\n")
        if problems:
            sys.stderr.write(f"{self.name} {trial}: {'; '.join(problems)[:600]}\n")

    @property
    def failures(self) -> list[dict[str, Any]]:
        """The trials with which something was wrong."""
        return [entry for entry in self.entries.values() if entry["problems"]]

    def summary(self) -> str:
        """Return one line that sums all up."""
        outcomes = Counter(entry["outcome"] for entry in self.entries.values())
        told = ", ".join(f"{count} {word}" for word, count in sorted(outcomes.items()))
        return f"{self.name}: {len(self.entries)} tried ({told}), {len(self.failures)} wrong"

    def finish(self) -> int:
        """Print the summary, and write the failures beside the outcomes; returns the exit code."""
        if self.path is not None:
            path = self.path.with_suffix(".failures.json")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(json.dumps(self.failures, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
        sys.stdout.write(self.summary() + "\n")
        sys.stdout.flush()
        return 1 if self.failures else 0
