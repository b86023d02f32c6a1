"""Which method takes which setting, what values they may have, and what the qualities give them."""

from __future__ import annotations

from dataclasses import fields
from importlib.util import find_spec
from typing import Any

import pytest

from radiosity_addon.bake.quality import QUALITY_SETTINGS, quality_of, used_settings
from radiosity_addon.base.errors import UsageError
from radiosity_addon.options import METHODS, OPTIONS, BakeSettings, options_of_method
from radiosity_addon.solver import SolverSettings

SETTINGS = {name: option for name, option in OPTIONS.items() if option.methods}

VALUES = {int: 7, float: 0.01, bool: True, str: "galerkin"}
"""A value that every setting of the kind may have, other than its preset (but for the assembly)."""


@pytest.mark.parametrize("method", METHODS)
def test_every_method_has_a_module_and_a_default_that_is_the_first(method: str) -> None:
    assert find_spec("radiosity_addon.solver.methods." + method.replace("-", "_")) is not None
    assert OPTIONS["method"].values == tuple(METHODS)
    assert BakeSettings().method == next(iter(METHODS)) == "hierarchical"


def test_settings_of_methods_are_fields_of_the_solver() -> None:
    names = {field.name for field in fields(SolverSettings)}
    assert set(SETTINGS) <= names
    # What no method lists all of them have.
    assert names - set(SETTINGS) == {"method", "shadow_rays", "seed", "threads"}


@pytest.mark.parametrize("name", SETTINGS)
@pytest.mark.parametrize("method", METHODS)
def test_each_pair_is_taken_or_refused_with_the_list(method: str, name: str) -> None:
    value = VALUES[SETTINGS[name].kind]
    if name in options_of_method(method):
        settings = BakeSettings(method=method, **{name: value})
        assert settings.method_settings() == {name: value}
        solver = quality_of(settings).solver
        assert solver.method == method
        assert used_settings(solver)[name] == value
        return
    with pytest.raises(UsageError) as refused:
        BakeSettings(method=method, **{name: value})
    message = str(refused.value)
    assert message.startswith(f"{SETTINGS[name].flag} does not apply to --method {method}; it takes ")
    listed = message.split("it takes ")[1].split(", ")
    assert listed == [SETTINGS[other].flag for other in options_of_method(method)]


@pytest.mark.parametrize("assembly", ["collocation", "linear"])
def test_conjugate_gradients_need_the_symmetric_system(assembly: str) -> None:
    with pytest.raises(UsageError, match="gauss-seidel"):
        BakeSettings(method="conjugate-gradient", assembly=assembly)
    for method in ("dense", "jacobi", "gauss-seidel"):
        assert quality_of(BakeSettings(method=method, assembly=assembly)).solver.assembly == assembly


def test_an_unknown_method_is_named_with_those_there_are() -> None:
    with pytest.raises(UsageError, match=r"'best'.*hierarchical.*dense"):
        BakeSettings(method="best")


@pytest.mark.parametrize("quality", QUALITY_SETTINGS)
def test_presets_keep_to_the_ranges_and_grow_finer(quality: str) -> None:
    solver = QUALITY_SETTINGS[quality].solver
    for name, setting in SETTINGS.items():
        setting.check(getattr(solver, name))
    assert solver.patches <= solver.elements
    ranks = list(QUALITY_SETTINGS)
    if quality != ranks[0]:
        coarser = QUALITY_SETTINGS[ranks[ranks.index(quality) - 1]].solver
        for name in ("elements", "patches"):
            assert getattr(solver, name) > getattr(coarser, name)
        for name in ("form_factor_error", "min_area", "contrast"):
            assert getattr(solver, name) < getattr(coarser, name)
        assert solver.error <= coarser.error


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"elements": 7}, (7, 7)),
        ({"patches": 5000}, (5000, 5000)),
        ({"elements": 900, "patches": 900}, (900, 900)),
        ({}, (1500, 200)),
    ],
)
def test_patches_never_outnumber_elements(given: dict[str, Any], expected: tuple[int, int]) -> None:
    solver = quality_of(BakeSettings(method="two-level", **given)).solver
    assert (solver.elements, solver.patches) == expected


def test_more_patches_than_elements_are_refused() -> None:
    with pytest.raises(UsageError, match=r"--patches 10.*--elements 9"):
        BakeSettings(method="two-level", elements=9, patches=10)


def test_seed_and_threads_reach_the_solver() -> None:
    solver = quality_of(BakeSettings(seed=5, threads=3)).solver
    assert (solver.seed, solver.threads) == (5, 3)
