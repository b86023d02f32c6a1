"""The names of all files that a bake writes.

The command line has a folder for each bake and plain names in it. Bakes from the panel may share a folder,
so there each name begins with those of the .blend and the scene.
"""

from __future__ import annotations

import hashlib
import re
import unicodedata
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import PurePath

BLEND_NAME = "baked.blend"
PREVIEW_NAME = "preview.png"
REPORT_NAME = "report.json"
SIDECAR_NAME = "lightmap.relight"

LIGHTMAPS = frozenset({".exr", ".png"})
"""Endings of lightmap files, in lower case."""

EXPORT_FOLDER = "export"
"""Folder of an export next to the command line's bake."""

EXPORT_ENDINGS = frozenset({".glb", ".ktx2"})
EXPORT_NAMES = frozenset({"lightmaps.json", "viewer.html", "three-lightmap.js", "LICENSES.txt"})
ENGINE_FOLDERS = {"godot": (".gd", ".md"), "unity": (".cs", ".md"), "bevy": (".rs", ".md")}
"""What an export writes besides lightmaps: folders of engines, with the endings of files in them."""

UNTITLED = "untitled"
"""Stands for the name of a .blend that was never saved."""

MAX_PART, MAX_OBJECT = 40, 100
"""Bytes of UTF-8 that the name of a .blend, scene or light group, and that of an object may take.

With all of them, separators, a number and an ending a name stays below the 255 bytes of file systems.
"""

_FORBIDDEN = re.compile(r'[\x00-\x1f\x7f<>:"/\\|?*\ud800-\udfff]')
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)


@dataclass(frozen=True, repr=False)
class FileNames:
    """The names of one bake's files.

    prefix: What they all begin with; "" for those of the command line.
    """

    prefix: str = ""

    @classmethod
    def of_scene(cls, blend: str, scene: str) -> FileNames:
        """Return the names of a scene's files in a folder that others use too.

        blend: The .blend's path, or its name; "" if it was never saved.
        """
        stem = PurePath(blend.replace("\\", "/")).stem or UNTITLED
        return cls(f"{sanitized(stem)}_{sanitized(scene)}_")

    @classmethod
    def of_report(cls, name: str) -> FileNames:
        """Return the names that belong with a report's."""
        return cls(name.removesuffix(REPORT_NAME))

    @property
    def report(self) -> str:
        """The report's name."""
        return self.prefix + REPORT_NAME

    @property
    def sidecar(self) -> str:
        """The name of the file that a bake is relit by."""
        return self.prefix + SIDECAR_NAME

    def shared_pages(self, count: int, group: str = "") -> list[str]:
        """Return the stems of pages that all objects share, or of a light group's; not yet unique."""
        return [self._stem("lightmap", group)] * count

    def object_page(self, name: str, group: str = "") -> str:
        """Return the stem of an object's page, or of that of a light group; not yet unique."""
        stem = sanitized(name, MAX_OBJECT)
        return self._stem(f"{stem}_lightmap" if self.prefix else stem, group)

    def _stem(self, stem: str, group: str) -> str:
        return f"{self.prefix}{stem}_{sanitized(group)}" if group else f"{self.prefix}{stem}"

    def reserved(self, ending: str) -> frozenset[str]:
        """Return stems, as `folded`, that no lightmap with this ending may have."""
        others = (BLEND_NAME, PREVIEW_NAME, self.report, self.sidecar)
        return frozenset(folded(PurePath(name).stem) for name in others if name.endswith(ending))


PLAIN_NAMES = FileNames()
"""Those of the command line."""


def unique_names(stems: Sequence[str], ending: str, taken: set[str]) -> list[str]:
    """Return file names that differ from each other and from the stems taken, and take theirs.

    ending: Such as ".exr".
    taken: Stems as `folded`; added to.
    """
    names = []
    for stem in stems:
        unique, number = stem, 1
        while folded(unique) in taken:
            number += 1
            unique = f"{stem}_{number}"
        taken.add(folded(unique))
        names.append(unique + ending)
    return names


def folded(name: str) -> str:
    """Return a name so that two names of one file are equal where upper and lower case do not count."""
    return unicodedata.normalize("NFC", name).casefold()


def sanitized(name: str, longest: int = MAX_PART) -> str:
    """Turn a name into part of a file name that every file system takes.

    One that is too long is cut, and ends with a digest of the whole.
    """
    stem = _FORBIDDEN.sub("_", unicodedata.normalize("NFC", name)).strip(" .")
    if len(stem.encode()) > longest:
        digest = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()[:8]
        stem = f"{stem.encode()[: longest - 9].decode('utf-8', 'ignore').strip(' .')}-{digest}"
    return f"_{stem}" if not stem or _DEVICES.fullmatch(stem) else stem


def is_bake_name(name: object) -> bool:
    """Return whether a bake or an export may write a file of this name.

    A bare one, with an ending of ours; only exports have folders of engines.
    """
    if not isinstance(name, str):
        return False
    folder, slash, own = name.rpartition("/")
    if not own or own.startswith(".") or _FORBIDDEN.search(own):
        return False
    if slash:
        return own.endswith(ENGINE_FOLDERS.get(folder, ()))
    if own == BLEND_NAME or own in EXPORT_NAMES or own.endswith(REPORT_NAME):
        return True
    return own.lower().endswith((*LIGHTMAPS, *EXPORT_ENDINGS, PurePath(SIDECAR_NAME).suffix))


def highest_page(names: Collection[str], most: int = 1000) -> int:
    """Return the highest number that lightmaps of these names could have as pages; 1 if there is none."""
    found = (re.search(r"_(\d{1,6})$", PurePath(name).stem) for name in names if is_bake_name(name))
    return max((int(each[1]) for each in found if each is not None and int(each[1]) <= most), default=1)
