"""EEVEE shows a lightmap as Cycles does."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.blender.eevee import seen_in_eevee

SCRIPT = """
from radiosity_addon.blender.datablocks import bake_record
bake_record.register()
emission = dict(Emission_Color=(0.25, 0.25, 0.25, 1.0), Emission_Strength=2.0)
hand_bake.add_plane(material=hand_bake.principled_material(**emission))
hand_bake.bake_by_hand(folder=Path(sys.argv[1]))
look()
"""


def test_eevee_shows_base_color_times_lightmap_plus_emission(tmp_path: Path) -> None:
    (seen,) = seen_in_eevee(SCRIPT, tmp_path)
    # Base color (0.5, 0.25, 0.75), texel (0.25, 0.5, 3), emission 0.5; EEVEE's pixels are half floats.
    assert seen == pytest.approx([0.625, 0.625, 2.75], rel=2e-3)
