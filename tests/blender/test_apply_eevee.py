"""EEVEE shows a lightmap, and what shines on it, as Cycles does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
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


SHINE = """
from radiosity_addon.blender.datablocks import bake_record
from tests.blender.scenes import add_lamp
bake_record.register()
for inputs, samples in (dict(Specular_IOR_Level=0.0, Alpha=0.5), 16), (dict(Metallic=1.0, Roughness=0.5), 1):
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    hand_bake.add_plane(material=hand_bake.principled_material(**inputs))
    hand_bake.bake_by_hand(folder=Path(sys.argv[1]), show="shine")
    look(samples)
    add_lamp("SUN", energy=3.0, use_shadow=False)
    look(samples)
    hand_bake.show_lightmaps("matte")
    look(samples)
"""


@pytest.mark.full  # a minute without a graphics card; test_shine.py asks it of Cycles
def test_in_eevee_lamps_light_what_shines_and_nothing_else(tmp_path: Path) -> None:
    (paint, lit_paint, matte_paint), (metal, lit_metal, matte_metal) = seen_in_eevee(SHINE, tmp_path).reshape(
        2, 3, 3
    )
    assert paint.any()
    np.testing.assert_array_equal(lit_paint, paint)
    np.testing.assert_array_equal(matte_paint, paint)
    assert not metal.any()
    assert (lit_metal > 0.1).all()
    np.testing.assert_allclose(matte_metal, [0.125, 0.125, 2.25], rtol=2e-3)


HALF_METAL = """
from radiosity_addon.blender.datablocks import bake_record
from tests.blender.scenes import add_lamp
bake_record.register()
for metallic in 0.25, 0.75:
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    hand_bake.add_plane(material=hand_bake.principled_material(Metallic=metallic, Roughness=0.4))
    bpy.context.scene.world = None
    turned = np.radians(50.0)
    add_lamp("SUN", energy=3.0, use_shadow=False, transform={"rotation_euler": (turned, 0.0, 0.0)})
    look()
    received = 3.0 * np.cos(turned) / np.pi
    hand_bake.bake_by_hand(((received,) * 3,), folder=Path(sys.argv[1]), show="shine")
    look()
"""


@pytest.mark.one_blender
def test_in_eevee_half_a_metal_looks_as_unbaked(tmp_path: Path) -> None:
    seen = seen_in_eevee("import numpy as np\n" + HALF_METAL, tmp_path)
    np.testing.assert_allclose(seen[1::2], seen[::2], rtol=0.01)
