"""Custom properties that identify a lightmap's image. Panels import this module, so it is light."""

from __future__ import annotations

SCALE_PROPERTY = "radiosity_lightmap_scale"
"""Multiply a texel by it to get the quantity."""

QUANTITY_PROPERTY = "radiosity_lightmap_quantity"
"""The quantity that it holds."""

LIGHT_PROPERTY = "radiosity_lightmap_light"
"""Which light it holds: `all`, `direct` or `indirect`; bakes of earlier versions do not say."""

PADDING_PROPERTY = "radiosity_lightmap_padding"
"""Free texels between its charts; bakes of earlier versions do not say."""

PAGE, GROUP = "radiosity_page", "radiosity_group_shown"
"""Its page's number, and the light group it shows, "" for all light."""

MARK = "radiosity_mark"
"""The mark of its bake, if that was kept."""

REPORT = "radiosity_report"
"""The name of the report next to its file, which lists it."""

VERSION = "radiosity_version"
"""The digest of the bytes of its file, or of what is packed: what its pixels are."""
