"""What rough mirrors reflect in all, so that they can bounce light as matte surfaces do.

Hemispherical albedos, of light that comes evenly from all directions, fitted to Cycles.
Over roughness 0 to 1 they are within 0.02 of it for metals, and within 0.01 for what lies
over a matte base (decision record 0022 has the figures).
"""

from __future__ import annotations

import numpy as np

from .node_algebra import NodeAlgebra, NodeColor, Scalar

_EXPONENT = 3.5
_WHITE_LOSS = 1.375
"""A white microfacet mirror without multiple scattering reflects 1 / (1 + 1.375 r^3.5)."""
_GRAZING, _GRAZING_LOSS = 0.0446, 15.5
"""What Fresnel adds at grazing angles to one that is black face on, and its loss likewise."""
_SEEN = ((3.0, 0.42, 7.5), (8.0, 0.58, 200.0))
"""The same by the viewer's angle: powers of one minus its cosine, their factors if smooth, and losses."""
_FRESNEL_OVER_SCHLICK = 1.07
_FAINT = 0.003
"""Where F0 is not much more than this, there is less to add at grazing angles: none at 0."""


def metal(
    algebra: NodeAlgebra, base: NodeColor, roughness: Scalar, multiple: bool, rougher: Scalar | None = None
) -> NodeColor:
    """Return the albedo of a metal of color `base`.

    multiple: With multiple scattering, by which a rough metal is not darker but deeper in color.
    rougher: The roughness that light meets, if it is not that by which multiple scattering is reckoned.
    """
    met = roughness if rougher is None else rougher
    white = _white(algebra, roughness)
    single = algebra.scale(base, _white(algebra, met))
    if multiple:
        # One minus base times what misses the first scattering.
        missed = algebra.scale(base, algebra.calculate("SUBTRACT", white, 1.0))
        single = algebra.divide(single, algebra.add(np.ones(3), missed))
    rest = algebra.add(np.ones(3), algebra.scale(base, -1.0))
    return algebra.add(single, algebra.scale(rest, _grazing(algebra, met)))


def kept_if_rougher(algebra: NodeAlgebra, roughness: Scalar, rougher: Scalar) -> Scalar:
    """Return the share of what a mirror reflects that is left if its microfacets become rougher."""
    return algebra.calculate("DIVIDE", _white(algebra, rougher), _white(algebra, roughness))


def dielectric(algebra: NodeAlgebra, ior: Scalar, level: Scalar, roughness: Scalar) -> Scalar:
    """Return the albedo of what shines on a matte base.

    ior: Index of refraction.
    level: Principled's Specular IOR Level: 0.5 leaves the reflection as the index says.
    """
    total = _layer(algebra, ior, level, roughness, _grazing(algebra, roughness))
    return algebra.saturate(algebra.calculate("MULTIPLY", total, _FRESNEL_OVER_SCHLICK))


def dielectric_seen(
    algebra: NodeAlgebra, ior: Scalar, level: Scalar, roughness: Scalar, away: Scalar
) -> Scalar:
    """Return the share of even light that what shines on a matte base reflects toward a viewer.

    away: One minus the cosine of the viewer's angle.
    """
    parts = [
        _falling(
            algebra,
            roughness,
            algebra.calculate("MULTIPLY", algebra.calculate("POWER", away, power), smooth),
            loss,
        )
        for power, smooth, loss in _SEEN
    ]
    return algebra.saturate(_layer(algebra, ior, level, roughness, algebra.calculate("ADD", *parts)))


def dielectric_normal(algebra: NodeAlgebra, ior: Scalar, level: Scalar) -> Scalar:
    """Return what a dielectric reflects of light that comes along the normal."""
    calculate = algebra.calculate
    ratio = calculate("DIVIDE", calculate("SUBTRACT", ior, 1.0), calculate("ADD", ior, 1.0))
    normal = calculate("MULTIPLY", calculate("MULTIPLY", ratio, ratio), calculate("MULTIPLY", level, 2.0))
    return algebra.saturate(normal)


def dielectric_rise(algebra: NodeAlgebra, normal: Scalar) -> Scalar:
    """Return how far a dielectric rises to 1 at grazing angles: not at all where it reflects nothing."""
    return algebra.calculate("DIVIDE", normal, algebra.calculate("ADD", normal, _FAINT))


def _layer(algebra: NodeAlgebra, ior: Scalar, level: Scalar, roughness: Scalar, grazing: Scalar) -> Scalar:
    """Return what a dielectric reflects; `grazing` is what Fresnel adds to one that is black face on."""
    calculate = algebra.calculate
    normal = dielectric_normal(algebra, ior, level)
    share = calculate("MULTIPLY", dielectric_rise(algebra, normal), algebra.complement(normal))
    added = calculate("MULTIPLY", share, grazing)
    return calculate("ADD", calculate("MULTIPLY", normal, _white(algebra, roughness)), added)


def _white(algebra: NodeAlgebra, roughness: Scalar) -> Scalar:
    return _falling(algebra, roughness, 1.0, _WHITE_LOSS)


def _grazing(algebra: NodeAlgebra, roughness: Scalar) -> Scalar:
    return _falling(algebra, roughness, _GRAZING, _GRAZING_LOSS)


def _falling(algebra: NodeAlgebra, roughness: Scalar, smooth: Scalar, loss: float) -> Scalar:
    """Return smooth / (1 + loss · roughness^3.5)."""
    power = algebra.calculate("POWER", algebra.saturate(roughness), _EXPONENT)
    lost = algebra.calculate("ADD", algebra.calculate("MULTIPLY", power, loss), 1.0)
    return algebra.calculate("DIVIDE", smooth, lost)
