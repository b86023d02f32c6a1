"""What panels draw is worked out on a timer, not while they are drawn."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import SimpleNamespace

import bpy
import pytest

from radiosity_addon.blender.session import facts
from radiosity_addon.blender.session.state import session


class Timers:
    """Blender's timers, which do not run without a window: a test runs them."""

    def __init__(self) -> None:
        self.waiting: list[Callable[[], object]] = []

    def is_registered(self, function: Callable[[], object]) -> bool:
        return function in self.waiting

    def register(self, function: Callable[[], object], **_: object) -> None:
        self.waiting.append(function)

    def unregister(self, function: Callable[[], object]) -> None:
        self.waiting.remove(function)

    def run(self) -> None:
        waiting, self.waiting = self.waiting, []
        for function in waiting:
            function()


@pytest.fixture
def timers(monkeypatch: pytest.MonkeyPatch) -> Iterator[Timers]:
    """A Blender with a window."""
    timers = Timers()
    app = SimpleNamespace(background=False, timers=timers)
    monkeypatch.setattr(facts, "bpy", SimpleNamespace(app=app, context=bpy.context))
    yield timers
    session.facts.clear()
    session.wanted_facts.clear()


def counted() -> tuple[Callable[[bpy.types.Context], int], list[int]]:
    """A fact that counts how often it was worked out, and the counts."""
    calls: list[int] = []

    @facts.fact(unknown=0)
    def count(_context: bpy.types.Context) -> int:
        calls.append(len(calls) + 1)
        return len(calls)

    return count, calls


def test_drawing_works_nothing_out(timers: Timers) -> None:
    count, calls = counted()
    assert count(bpy.context) == 0
    assert calls == []
    timers.run()
    assert count(bpy.context) == 1
    assert count(bpy.context) == 1
    assert calls == [1]
    assert timers.waiting == []  # it is not old yet


def test_a_change_of_the_scene_has_it_worked_out_again(timers: Timers) -> None:
    count, _ = counted()
    count(bpy.context)
    timers.run()
    facts.outdate()
    timers.run()
    assert count(bpy.context) == 2


def test_an_operator_can_have_it_worked_out_at_once(timers: Timers) -> None:
    count, _ = counted()
    count(bpy.context)
    facts.refresh()
    assert count(bpy.context) == 1


def test_nothing_is_worked_out_while_a_bake_runs(timers: Timers, monkeypatch: pytest.MonkeyPatch) -> None:
    count, calls = counted()
    monkeypatch.setattr(session.running, "active", True)
    count(bpy.context)
    timers.run()
    assert calls == []


def test_what_no_panel_draws_any_more_is_left_alone(timers: Timers, monkeypatch: pytest.MonkeyPatch) -> None:
    count, calls = counted()
    count(bpy.context)
    timers.run()
    monkeypatch.setattr(facts, "NOT_WANTED_AFTER", -1.0)
    facts.outdate()
    timers.run()
    assert calls == [1]


def test_without_a_window_there_is_no_waiting() -> None:
    count, _ = counted()
    assert count(bpy.context) == 1
