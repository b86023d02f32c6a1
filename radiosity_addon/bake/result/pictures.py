"""Pictures of the light so far, shown while a bake runs."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ...numerics import Array


@dataclass(frozen=True)
class Picture:
    """What the solution looks like so far: its elements, to be drawn as they are.

    corners (n, 3, 3) float32: World space, counter-clockwise from the side that is seen.
    radiosity (n, 3) float32 [W/m²].
    triangle (n,) int32: The scene's triangle that each is a part of.
    front (n,) bool: Whether it is on the triangle's front.
    """

    corners: Array
    radiosity: Array
    triangle: Array
    front: Array

    def __len__(self) -> int:
        return len(self.radiosity)

    def only(self, elements: Array) -> Picture:
        """Return the picture of some of its elements, given as (n,) bool."""
        return Picture(
            self.corners[elements], self.radiosity[elements], self.triangle[elements], self.front[elements]
        )


@dataclass(frozen=True, eq=False)
class TexelSurfaces:
    """Triangles with a lightmap, and the texels on them.

    corners (t, 3, 3) float32: World space, counter-clockwise from the front.
    uv (t, 3, 2) float32.
    page (t,) int32.
    triangle (t,) int32: The scene's triangle that each is.
    texels tuple of (height, width) int32: Per page, the number of the texel there, −1 for none. A large page
        may come coarser than it is.
    """

    corners: Array
    uv: Array
    page: Array
    triangle: Array
    texels: tuple[Array, ...]

    def only(self, triangles: Array) -> TexelSurfaces:
        """Return those of the scene's triangles that are marked in a (scene triangles,) mask."""
        shown = triangles[self.triangle]
        return replace(
            self,
            corners=self.corners[shown],
            uv=self.uv[shown],
            page=self.page[shown],
            triangle=self.triangle[shown],
        )


@dataclass(frozen=True, eq=False)
class TexelPicture:
    """What the lightmaps look like so far.

    surfaces: The same for all pictures of a bake.
    radiosity (n, 3) float32 [W/m²]: Of the texels.
    """

    surfaces: TexelSurfaces
    radiosity: Array
