"""Pages that objects ask for."""

from __future__ import annotations

from collections.abc import Sequence

from ...base import UsageError
from ...options import BakeSettings
from ..scene_records.pieces import Piece


def check_pages(chosen: Sequence[Piece], settings: BakeSettings) -> None:
    """Refuse pages of objects that a bake will not have."""
    if settings.atlas != "shared" or settings.texel_density is not None:
        return
    beyond = next((piece for piece in chosen if piece.role.page > settings.pages), None)
    if beyond is not None:
        has = "1 page" if settings.pages == 1 else f"{settings.pages} pages"
        raise UsageError(
            f"object '{beyond.source.object_name}' is to be on page {beyond.role.page}, but the bake has "
            f"{has}: raise the number of pages, or set the object's Page to 0"
        )
