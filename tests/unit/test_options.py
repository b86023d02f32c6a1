"""The table of options: what its records may say, and that every bake keeps to it."""

from __future__ import annotations

import math
from typing import Any

import pytest

from radiosity_addon.base.errors import UsageError
from radiosity_addon.options import METHODS, OPTIONS, SECTIONS, UNBOUNDED, BakeSettings

NUMBERS = [name for name, option in OPTIONS.items() if option.kind in (int, float)]
CHOICES = [name for name, option in OPTIONS.items() if option.choices]


def settings_with(name: str, value: Any) -> BakeSettings:
    """Settings with one option that is not the default, of a method that has it."""
    methods = OPTIONS[name].methods
    # The last of them takes all choices.
    return BakeSettings(**{"method": methods[-1]} if methods else {}, **{name: value})


@pytest.mark.parametrize("name", OPTIONS)
def test_what_an_option_names_exists(name: str) -> None:
    option = OPTIONS[name]
    assert option.section in SECTIONS
    assert set(option.methods) <= set(METHODS)
    # The command line makes them exclusive section by section; a flag that switches something off says so.
    assert not option.instead_of or OPTIONS[option.instead_of].section == option.section
    assert option.kind is not bool or bool(option.off) == bool(option.default)
    assert option.kind in (int, float, bool, str, tuple)
    assert (option.kind is str) == bool(option.choices)
    if option.kind in (int, float):
        assert math.isfinite(option.limits[0])


def test_flags_and_properties_are_different() -> None:
    for names in (
        [option.flag for option in OPTIONS.values()],
        [each.identifier for each in OPTIONS.values()],
    ):
        assert len(set(names)) == len(names)


@pytest.mark.parametrize("name", NUMBERS)
def test_numbers_keep_to_their_range_or_are_named(name: str) -> None:
    option = OPTIONS[name]
    low, high = option.limits
    beyond = [low - 1, -math.inf, math.nan, *([low] if option.above else [])]
    beyond += [] if high == UNBOUNDED else [high + 1, math.inf]
    for value in beyond:
        with pytest.raises(UsageError, match=f"^{option.flag} {value} is not "):
            settings_with(name, value)
    for value in (high, *([] if option.above else [low])):
        assert getattr(settings_with(name, value), name) == value


@pytest.mark.parametrize("name", CHOICES)
def test_choices_are_those_of_the_table_or_the_error_lists_them(name: str) -> None:
    option = OPTIONS[name]
    for value in option.values:
        assert getattr(settings_with(name, value), name) == value
    for value in ("", option.values[0].upper(), option.values[0] + "x"):
        with pytest.raises(UsageError, match=f"^{option.flag} '{value}' is not one of {option.values[0]}, "):
            settings_with(name, value)
