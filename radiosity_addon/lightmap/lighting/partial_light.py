"""The light of texels while it is still being computed, to be looked at.

At first it is the hierarchy's. After each lamp, texels get the detail of direct light that elements are too
large for; after gather points, they and the texels around them get what their rays brought; each sweep
replaces it all. Nothing of it goes into the result.
"""

from __future__ import annotations

import numpy as np

from ...numerics import Array, tiles
from ...solver.gather import NOTHING, GatheredHits, LocalPass, values_of
from ..texels import NO_TEXEL, TexelGeometry
from ..transport import HitTable

EVERY = 4
"""One of this many gather rays is looked up: a picture needs no more, and must cost next to nothing."""

CHUNK = 1 << 14
"""Gather points whose rays are looked up at once; bounds the temporaries to about 20 MB."""

ALIKE = 0.9
"""Cosine between the normals of a gather point and of a texel it may stand for."""


class LightSoFar:
    """What is known of n texels' light; `light_texels` fills it in.

    Attributes
    ----------
    version : int
        Higher whenever something new is known; 0 before the texels are.
    geometry : TexelGeometry
    """

    def __init__(self) -> None:
        self.version = 0
        self.geometry: TexelGeometry | None = None
        self._local: LocalPass | None = None
        self._table: HitTable | None = None
        self._element = np.zeros(0, dtype=np.int32)
        self._direct = self._reflectance = self._emission = np.zeros((0, 3))
        self._waiting: list[tuple[Array, GatheredHits, int]] = []
        self._expected: Array | None = None
        self._indirect: Array | None = None
        self._gathered = np.zeros(0, dtype=bool)
        self._swept: Array | None = None

    def begin(
        self,
        local: LocalPass,
        geometry: TexelGeometry,
        element: Array,
        direct: Array,
        materials: tuple[Array, Array],
    ) -> None:
        """Start from the hierarchy's light.

        Parameters
        ----------
        element : (n,) int32
            The leaf element below each texel, or NOTHING.
        direct : (n, 3) float64 [W/m²]
            All 0; it grows lamp by lamp.
        materials : reflectance and emission, (n, 3) float64 each
        """
        self.geometry, self._local, self._element = geometry, local, element
        self._direct, (self._reflectance, self._emission) = direct, materials
        self._waiting, self._indirect = [], None
        self._gathered = np.zeros(len(geometry), dtype=bool)
        self.version += 1

    def lamp_done(self) -> None:
        """Note that another lamp has been asked everywhere."""
        self.version += 1

    def met(self, table: HitTable, rows: Array, gathered: GatheredHits, stride: int) -> None:
        """Note what (g,) texels gathered that lie `stride` texels apart."""
        if len(rows):
            self._table = table
            self._waiting.append((rows, gathered, stride))
            self.version += 1

    def swept(self, irradiance: Array) -> None:
        """Note the (n, 3) irradiance after a sweep [W/m²]."""
        self._swept = irradiance
        self.version += 1

    def radiosity(self) -> Array:
        """Return (n, 3) float32 what the texels send out, as far as that is known [W/m²]."""
        irradiance = self._irradiance() if self._swept is None else self._swept
        return np.asarray(self._emission + self._reflectance * irradiance, dtype=np.float32)

    def _irradiance(self) -> Array:
        if self._expected is None:
            assert self._local is not None
            self._expected = values_of(self._local.elements.irradiance, self._element)
        # The elements' light, spread over their texels as the direct light is: its mean stays theirs.
        detail = self._direct - self._means_of_elements(self._direct)
        light = np.maximum(self._expected + detail, self._direct) if detail.any() else self._expected.copy()
        self._look_up()
        if self._indirect is not None:
            light[self._gathered] = (self._direct + self._indirect)[self._gathered]
        return light

    def _means_of_elements(self, values: Array) -> Array:
        """Return (n, 3): the means of texels' values over those of the same element."""
        row = self._element - NOTHING
        count = np.maximum(np.bincount(row), 1)
        means = np.stack([np.bincount(row, channel) / count for channel in values.T], axis=1)
        return np.asarray(means[row])

    def _look_up(self) -> None:
        """Look up what came since the last time."""
        waiting, self._waiting = self._waiting, []
        for rows, gathered, stride in waiting:
            if self._indirect is None:
                self._indirect = np.zeros_like(self._direct)
            texel, point = self._around(rows, stride)
            self._indirect[texel] = self._brought(gathered)[point]
            self._gathered[texel] = True

    def _around(self, rows: Array, stride: int) -> tuple[Array, Array]:
        """Return the texels that gather points speak for in the picture, and which point each takes."""
        geometry = self.geometry
        assert geometry is not None
        step = np.stack(np.divmod(np.arange(stride**2), stride), axis=1)
        row, column = (
            at[rows][:, None] + step[:, axis] for axis, at in enumerate((geometry.row, geometry.column))
        )
        texel = np.full(row.shape, NO_TEXEL, dtype=np.int32)
        for page, numbers in enumerate(geometry.index):
            on_page = (geometry.page[rows] == page)[:, None] & (row < len(numbers)) & (column < len(numbers))
            texel[on_page] = numbers[row[on_page], column[on_page]]
        normal = geometry.surface_normal
        near = np.einsum("gk,gsk->gs", normal[rows], normal[texel]) > ALIKE
        point = np.broadcast_to(np.arange(len(rows))[:, None], texel.shape)
        found = (texel != NO_TEXEL) & near
        return texel[found], point[found]

    def _brought(self, gathered: GatheredHits) -> Array:
        """Return (g, 3) what rays brought by the hierarchy's light [W/m²]."""
        mean, aimed = np.empty((len(gathered.sources), 3)), gathered.aimed
        for rows in tiles(len(mean), CHUNK):
            seen = self._values_at(gathered.sources[rows, ::EVERY])
            mean[rows] = (seen if gathered.tints is None else seen * gathered.tints[rows, ::EVERY]).mean(
                axis=1
            )
        for rows in tiles(len(aimed.row), CHUNK):
            sources, weights = aimed.sources[rows], aimed.weights[rows]
            seen = self._values_at(sources)
            seen[sources < 0] = 0.0
            brought = np.einsum("akc,ak->ac" if weights.ndim == 2 else "akc,akc->ac", seen, weights)
            mean[aimed.row[rows]] += brought
        return np.asarray(mean)

    def _values_at(self, sources: Array) -> Array:
        """Return (g, k, 3) the radiosity of (g, k) hits as they are numbered before the table is made."""
        assert self._table is not None
        return self._table.expected(sources, self._element)
