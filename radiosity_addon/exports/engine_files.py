"""Files of an export that are the same for every scene: the loader, and the engines' scripts."""

from __future__ import annotations

from pathlib import Path

from ..options import Form

ASSETS = Path(__file__).parent / "assets"


def static_files(form: Form) -> dict[str, bytes]:
    """Return the files of forms that are the same for every scene, by their path in the export's folder."""
    names = [*(["three-lightmap.js"] if form.viewer else [])]
    for engine in form.engines:
        names += [f"{engine}/{path.name}" for path in sorted((ASSETS / engine).iterdir()) if path.is_file()]
    return {name: (ASSETS / name).read_bytes() for name in names}
