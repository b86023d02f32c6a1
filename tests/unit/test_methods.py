"""Which method takes which setting, what values they may have, and what the qualities give them."""

from __future__ import annotations

import math
import re
from dataclasses import fields
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from radiosity_addon.bake.quality import QUALITIES, SHOOTING_TOLERANCES, quality_of, used_settings
from radiosity_addon.base.errors import UsageError
from radiosity_addon.options.bake_settings import BakeSettings
from radiosity_addon.options.methods import METHODS, SETTINGS
from radiosity_addon.options.solver_settings import SolverSettings

VALUES = {
    "elements": 700,
    "assembly": "galerkin",
    "patches": 30,
    "contrast": 0.3,
    "form_factor_error": 0.02,
    "error": 1e-3,
    "min_area": 1e-3,
    "max_links": 9000,
    "ambient": True,
    "tolerance": 1e-6,
    "max_iterations": 40,
    "memory_limit": 0.25,
}
"""A value that each setting may have, other than its preset (but for the assembly)."""

MATRIX = {"elements", "assembly", "memory_limit"}
ITERATED = MATRIX | {"tolerance", "max_iterations"}
EXPECTED = {
    "dense": MATRIX,
    "jacobi": ITERATED,
    "gauss-seidel": ITERATED,
    "conjugate-gradient": ITERATED,
    "shooting": {"elements", "ambient", "tolerance", "max_iterations", "memory_limit"},
    "two-level": {"elements", "patches", "contrast", "memory_limit"},
    "multi-level": {
        *("form_factor_error", "min_area", "max_links", "tolerance", "max_iterations", "memory_limit"),
    },
    "hierarchical": {"error", "min_area", "max_links", "tolerance", "max_iterations", "memory_limit"},
}


def test_the_table_is_that_of_the_docs() -> None:
    assert {name: set(method.settings) for name, method in METHODS.items()} == EXPECTED
    assert set(VALUES) == set(SETTINGS)
    assert BakeSettings().method == next(iter(METHODS)) == "hierarchical"


@pytest.mark.parametrize("method", METHODS)
def test_every_method_has_a_module_and_words_for_people(method: str) -> None:
    assert find_spec("radiosity_addon.solver.methods." + method.replace("-", "_")) is not None
    assert METHODS[method].label
    assert METHODS[method].description


def test_settings_are_fields_of_the_solver_and_of_a_bake() -> None:
    for record in (SolverSettings, BakeSettings):
        assert set(SETTINGS) <= {field.name for field in fields(record)}
    # What no method lists all of them have.
    rest = {field.name for field in fields(SolverSettings)} - set(SETTINGS)
    assert rest == {"method", "shadow_rays", "seed", "threads"}


@pytest.mark.parametrize("name", SETTINGS)
@pytest.mark.parametrize("method", METHODS)
def test_each_pair_is_taken_or_refused_with_the_list(method: str, name: str) -> None:
    given = {name: VALUES[name]}
    if name in EXPECTED[method]:
        settings = BakeSettings(method=method, **given)
        assert settings.method_settings() == given
        solver = quality_of(settings).solver
        assert solver.method == method
        assert used_settings(solver)[name] == VALUES[name]
        return
    with pytest.raises(UsageError) as refused:
        BakeSettings(method=method, **given)
    said = str(refused.value)
    assert said.startswith(f"{SETTINGS[name].option} does not apply to --method {method}; it takes ")
    listed = said.split("it takes ")[1].split(", ")
    assert listed == [SETTINGS[other].option for other in METHODS[method].settings]


@pytest.mark.parametrize("assembly", ["collocation", "linear"])
def test_conjugate_gradients_need_the_symmetric_system(assembly: str) -> None:
    with pytest.raises(UsageError, match="gauss-seidel"):
        BakeSettings(method="conjugate-gradient", assembly=assembly)
    for method in ("dense", "jacobi", "gauss-seidel"):
        assert quality_of(BakeSettings(method=method, assembly=assembly)).solver.assembly == assembly


@pytest.mark.parametrize(
    ("name", "bad", "good"),
    [
        ("elements", [0, -1, 10_000_001], [1, 10_000_000]),
        ("patches", [0, 10_000_001], [1]),
        ("assembly", ["", "Galerkin", "quadratic"], ["galerkin"]),
        ("contrast", [0.0, -0.1, 1001, math.nan], [1e-9, 1000.0]),
        ("form_factor_error", [-1e-9, 1.01, math.nan, math.inf], [0.0, 1.0]),
        ("error", [0.0, 1.01, math.nan], [1e-12, 1.0]),
        ("min_area", [0.0, 1.01, math.nan], [1e-12, 1.0]),
        ("max_links", [0], [1]),
        ("tolerance", [0.0, 1.01, math.nan, -math.inf], [1e-15, 1.0]),
        ("max_iterations", [0, -5], [1]),
        ("memory_limit", [0.0, -1.0, math.inf, math.nan], [0.001]),
    ],
)
def test_values_out_of_range_are_named(name: str, bad: list, good: list) -> None:
    method = next(method for method in METHODS if name in METHODS[method].settings)
    for value in bad:
        with pytest.raises(UsageError, match=f"^{SETTINGS[name].option} "):
            BakeSettings(method=method, **{name: value})
    for value in good:
        assert BakeSettings(method=method, **{name: value}).method_settings() == {name: value}


def test_an_unknown_method_is_named_with_those_there_are() -> None:
    with pytest.raises(UsageError, match=r"'best' is not one of hierarchical, .*, dense"):
        BakeSettings(method="best")


@pytest.mark.parametrize("quality", QUALITIES)
def test_presets_keep_to_the_ranges_and_grow_finer(quality: str) -> None:
    solver = QUALITIES[quality].solver
    for name, setting in SETTINGS.items():
        setting.check(getattr(solver, name))
    assert solver.patches <= solver.elements
    ranks = list(QUALITIES)
    if quality != ranks[0]:
        coarser = QUALITIES[ranks[ranks.index(quality) - 1]].solver
        for name in ("elements", "patches"):
            assert getattr(solver, name) > getattr(coarser, name)
        for name in ("error", "form_factor_error", "min_area", "contrast"):
            assert getattr(solver, name) < getattr(coarser, name)


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
    with pytest.raises(UsageError, match="--patches 10 is more than --elements 9"):
        BakeSettings(method="two-level", elements=9, patches=10)


def test_seed_and_threads_reach_the_solver() -> None:
    solver = quality_of(BakeSettings(seed=5, threads=3)).solver
    assert (solver.seed, solver.threads) == (5, 3)


README = (Path(__file__).resolve().parents[2] / "README.md").read_text(encoding="utf-8")


def test_the_readme_lists_the_settings_of_each_method() -> None:
    rows = re.findall(r"^\| ((?:`[a-z-]+`(?:, )?)+) \| ((?:`--[a-z-]+` ?)+)\|$", README, re.MULTILINE)
    listed = {
        method: tuple(re.findall("`(.+?)`", options))
        for methods, options in rows
        for method in re.findall("`(.+?)`", methods)
    }
    assert listed == {
        name: tuple(SETTINGS[setting].option for setting in method.settings)
        for name, method in METHODS.items()
    }


def test_the_readme_tells_when_shooting_stops() -> None:
    told = ", ".join(str(SHOOTING_TOLERANCES[name]) for name in QUALITIES)
    assert f"`shooting` takes {told})" in README


@pytest.mark.parametrize("name", SETTINGS)
def test_the_readme_tells_the_presets(name: str) -> None:
    (told,) = re.findall(rf"^\| `{SETTINGS[name].option}[` ].*\| (.+) \|$", README, re.MULTILINE)
    presets = [getattr(quality.solver, name) for quality in QUALITIES.values()]
    if name == "ambient":
        assert (told, set(presets)) == ("off", {False})
    elif name == "assembly":
        assert {told.strip("`")} == set(presets)
    else:
        # Thousands have a comma without a space.
        numbers = [float(number.replace(",", "")) for number in told.split(", ")]
        assert numbers == (presets if len(numbers) > 1 else [presets[0]])
        assert len(numbers) == len(set(presets))
