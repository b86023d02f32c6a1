"""viewer.html: program, scene and lightmaps in one file, which opens from the disk without network."""

from __future__ import annotations

import base64
import html
from collections.abc import Mapping

from .engine_files import ASSETS

TITLE, PROGRAM, DATA = "<!--TITLE-->", "<!--PROGRAM-->", "<!--DATA-->"


def viewer_page(title: str, files: Mapping[str, bytes]) -> bytes:
    """Return the page that shows files: `scene.glb`, `lightmaps.json` and its .ktx2 images."""
    page = (ASSETS / "viewer" / "viewer.html").read_text(encoding="utf-8")
    program = (ASSETS / "viewer" / "viewer.js").read_text(encoding="utf-8")
    data = "\n".join(
        f'<script type="text/plain" data-file="{html.escape(name, quote=True)}">'
        f"{base64.b64encode(content).decode()}</script>"
        for name, content in files.items()
    )
    # In a script an end tag would end it.
    program = "<script>" + program.replace("</script", "<\\/script") + "</script>"
    parts = {TITLE: html.escape(title), DATA: data, PROGRAM: program}
    for mark, text in parts.items():
        page = page.replace(mark, text, 1)
    return page.encode()
