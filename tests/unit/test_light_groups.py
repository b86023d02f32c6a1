"""Which source is in which light group, by the scene and by name, and what is refused before the work."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.bake.pipeline import bake
from radiosity_addon.bake.relight.light_groups import are_wanted, check_groups, members, share_out
from radiosity_addon.base.errors import UsageError
from radiosity_addon.options import MAX_GROUPS, OTHERS, BakeSettings
from radiosity_addon.scene.bake_scene import BakeScene
from tests.relit_rooms import lit_bake

NAMES = ("Bulb", "Bulb", "Window", "World", "Glow")
OF_SCENE = ("left", "right", "", "", "right")
LIT = np.ones((5, 3))


def found(strengths: np.ndarray = LIT, of_scene: tuple[str, ...] = OF_SCENE, **settings: object) -> dict:
    chosen = members(BakeSettings(**settings), NAMES, of_scene, strengths)
    assert sum(rows for _, rows in chosen).max() <= 1
    return {name: np.flatnonzero(rows).tolist() for name, rows in chosen}


def test_the_scene_s_groups_come_by_name_and_the_others_last() -> None:
    assert list(found(light_groups=True).items()) == [("left", [0]), ("right", [1, 4]), (OTHERS, [2, 3])]


def test_without_being_requested_the_scene_s_groups_do_not_count() -> None:
    assert found(groups=(("sky", ("World",)),)) == {"sky": [3], OTHERS: [0, 1, 2, 4]}


def test_groups_that_are_named_win_and_may_have_a_name_of_the_scene_s() -> None:
    groups = (("right", ("World",)), ("bulbs", ("Bulb",)))
    assert found(groups=groups, light_groups=True) == {"right": [3, 4], "bulbs": [0, 1], OTHERS: [2]}


def test_dark_sources_make_no_others_but_stay_in_their_groups() -> None:
    dark = np.zeros((5, 3))
    assert found(dark, light_groups=True) == {"left": [0], "right": [1, 4]}


def test_a_group_called_others_is_the_one_there_is() -> None:
    assert found(light_groups=True, of_scene=("", "a", "", OTHERS, "")) == {"a": [1], OTHERS: [0, 2, 3, 4]}
    assert found(groups=((OTHERS, ("World",)),)) == {OTHERS: [0, 1, 2, 3, 4]}


def grouped(*groups: str) -> BakeScene:
    """The room with its four lights in these groups."""
    return replace(lit_bake(), light_groups=groups, emitter_groups=("", ""))


def test_groups_are_wanted_where_there_are_some() -> None:
    assert not are_wanted(grouped("a", "", "", ""), BakeSettings())
    assert are_wanted(grouped("a", "", "", ""), BakeSettings(light_groups=True))
    assert not are_wanted(grouped("", "", "", ""), BakeSettings(light_groups=True))
    assert are_wanted(lit_bake(), BakeSettings(groups=(("a", ("Bulb",)),)))


def test_too_many_groups_and_unknown_members_are_refused_before_the_work() -> None:
    with pytest.raises(UsageError, match="'Moon'"):
        bake(lit_bake(), BakeSettings(groups=(("night", ("Moon",)),)))
    scene = lit_bake()
    scene.scene.lights = scene.scene.lights[:1] * (MAX_GROUPS + 1)
    many = tuple(f"group {number}" for number in range(MAX_GROUPS + 1))
    scene = replace(scene, light_groups=many, emitter_groups=(many[0], many[1]))
    with pytest.raises(UsageError, match=f"{MAX_GROUPS + 1} light groups are more than the {MAX_GROUPS}"):
        check_groups(scene, BakeSettings(light_groups=True))
    check_groups(replace(scene, light_groups=(many[0], *many[:-1])), BakeSettings(light_groups=True))


def test_settings_refuse_methods_and_quantities_without_groups() -> None:
    with pytest.raises(UsageError, match="jacobi keeps no links"):
        BakeSettings(light_groups=True, method="jacobi")
    with pytest.raises(UsageError, match="residual"):
        BakeSettings(light_groups=True, quantity="residual")
    with pytest.raises(UsageError, match="has no name"):
        BakeSettings(groups=(("", ("Bulb",)),))


def test_what_nobody_has_goes_to_the_largest() -> None:
    parts = np.array([[2.0, 0.0, -1.0], [6.0, 0.0, 3.0]])
    share_out(np.array([4.0, 0.5, 3.0]), list(parts))
    np.testing.assert_allclose(parts, [[1.0, 0.0, 0.0], [3.0, 0.5, 3.0]])
