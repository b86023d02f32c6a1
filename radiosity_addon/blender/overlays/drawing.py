"""What our draw handlers share: where to draw, and surfaces that show one texel of an image each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING, Any

import gpu
from mathutils import Matrix

if TYPE_CHECKING:
    from ...numerics import Array

NEARER = 2e-5
"""How much nearer than its object something is drawn, as a share of half the range of depths."""

_VERTEX = """
void main()
{
  spot = uv;
  gl_Position = matrix * vec4(pos, 1.0);
}
"""

# What is given is display colors; what the viewport draws over the scene encodes what it is given.
_FRAGMENT = """
vec3 decoded(vec3 srgb)
{
  return mix(srgb / 12.92, pow((srgb + 0.055) / 1.055, vec3(2.4)), step(0.04045, srgb));
}

void main()
{
  ivec2 size = textureSize(page, 0);
  ivec2 texel = clamp(ivec2(floor(spot * vec2(size))), ivec2(0), size - 1);
  vec4 shown = texelFetch(page, texel, 0);
  if (shown.a <= 0.0) {
    discard;
  }
  color = vec4(decoded(shown.rgb), shown.a);
}
"""


@cache
def page_shader() -> Any:
    """Return the shader that shows texels as they are, none of them smoothed into its neighbors."""
    between = gpu.types.GPUStageInterfaceInfo("radiosity_page")
    between.smooth("VEC2", "spot")
    info = gpu.types.GPUShaderCreateInfo()
    info.push_constant("MAT4", "matrix")
    info.sampler(0, "FLOAT_2D", "page")
    info.vertex_in(0, "VEC3", "pos")
    info.vertex_in(1, "VEC2", "uv")
    info.vertex_out(between)
    info.fragment_out(0, "VEC4", "color")
    info.vertex_source(_VERTEX)
    info.fragment_source(_FRAGMENT)
    return gpu.shader.create_from_info(info)


class PagedSurfaces:
    """Triangles on the graphics card, page by page, and a texture for each page.

    corners (t, 3, 3) float32: World space, counter-clockwise from the front.
    uv (t, 3, 2) float32.
    page (t,) int.
    """

    def __init__(self, corners: Array, uv: Array, page: Array) -> None:
        import numpy as np
        from gpu_extras.batch import batch_for_shader

        shader = page_shader()
        self._batches = {}
        for number in np.unique(page):
            on_page = page == number
            given = {
                "pos": np.ascontiguousarray(corners[on_page].reshape(-1, 3), dtype=np.float32),
                "uv": np.ascontiguousarray(uv[on_page].reshape(-1, 2), dtype=np.float32),
            }
            self._batches[int(number)] = batch_for_shader(shader, "TRIS", given)
        self._textures: list[Any] = []

    def paint(self, pages: Sequence[Array]) -> None:
        """Give the pages their colors: (height, width, 4) float32 each; what has no alpha is not drawn."""
        import numpy as np

        self._textures = []
        for colors in pages:
            height, width = colors.shape[:2]
            data = gpu.types.Buffer("FLOAT", 4 * width * height, np.ascontiguousarray(colors).ravel())
            self._textures.append(gpu.types.GPUTexture((width, height), format="RGBA8", data=data))

    def draw(self) -> None:
        """Draw them into the viewport whose turn it is."""
        shader = page_shader()
        shader.bind()
        shader.uniform_float(
            "matrix", gpu.matrix.get_projection_matrix() @ gpu.matrix.get_model_view_matrix()
        )
        for number, batch in self._batches.items():
            if number < len(self._textures):
                shader.uniform_sampler("page", self._textures[number])
                batch.draw(shader)


@contextmanager
def over_the_objects(culled: bool = True, nearer: float = NEARER) -> Iterator[None]:
    """Draw what lies where the objects lie, in front of them.

    culled: Whether only what is counter-clockwise is seen.
    nearer: In what has been drawn so before, more brings it in front.
    """
    depth_test, depth_mask = gpu.state.depth_test_get(), gpu.state.depth_mask_get()
    projection = Matrix.Translation((0.0, 0.0, -nearer)) @ gpu.matrix.get_projection_matrix()
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.depth_mask_set(True)
    gpu.state.face_culling_set("BACK" if culled else "NONE")
    try:
        with gpu.matrix.push_pop_projection():
            gpu.matrix.load_projection_matrix(projection)
            yield
    finally:
        gpu.state.face_culling_set("NONE")
        gpu.state.depth_mask_set(depth_mask)
        gpu.state.depth_test_set(depth_test)
