"""The lightmaps of an export: pages as arrays, the files of their encodings, and what lightmaps.json says."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from ...exports import (
    GroupEntry,
    LightmapIndex,
    LightmapPlace,
    NodeEntry,
    PageEntry,
    write_half_exr,
    write_ktx2,
    write_rgbm,
)
from ...files import PLAIN_NAMES, unique_names
from ...numerics import Array
from ...options import EFFICACY, ENGINE_PADDING, Form
from .export_scene import ExportScene, lamps_in
from .shown_lightmaps import light_of

EXR, KTX2, RGBM = ".exr", ".ktx2", "_rgbm.png"


def endings(form: Form) -> tuple[str, ...]:
    """Return what the names of a lightmap's files end with."""
    return (EXR, KTX2, *((RGBM,) if form.rgbm else ()))


def rgbm_names(stems: Iterable[Iterable[str]]) -> list[str]:
    """Return the names of all lightmaps as RGBM."""
    return [f"{stem}{RGBM}" for of in stems for stem in of]


@dataclass(frozen=True, eq=False)
class ExportedLightmaps:
    """The pages of an export as arrays, and the names of their files.

    groups: Light groups that have lightmaps of their own, with their factors.
    mix: The factors of all light groups.
    stems: Of the files' names: of the pages of all light, then of each group's.
    endings: Of the files' names.
    """

    light: str
    pages: tuple[Array, ...]
    groups: tuple[tuple[str, tuple[float, float, float], tuple[Array, ...]], ...]
    mix: dict[str, tuple[float, float, float]]
    stems: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...]
    endings: tuple[str, ...]

    @classmethod
    def of(cls, scene: ExportScene, form: Form) -> ExportedLightmaps:
        """Read the lightmaps that a scene shows."""
        shown = scene.shown
        pages = tuple(shown.page(number) for number in range(len(shown.images)))
        groups = tuple(
            (group.name, group.factor, tuple(map(light_of, group.images)))
            for group in (() if form.sum_groups else shown.groups)
        )
        mix = {group.name: group.factor for group in shown.groups}
        taken: set[str] = set()
        names = [PLAIN_NAMES.shared_pages(len(pages), group) for group in ("", *(each[0] for each in groups))]
        stems = tuple(tuple(unique_names(of, "", taken)) for of in names)
        notes = list(dict.fromkeys(note for material in scene.materials for note in material.notes))
        if shown.light == "indirect":
            notes.append("the lightmap holds indirect light: lamps are exported, but glTF has no area lamps")
        if scene.left_out:
            named = ", ".join(f"'{name}'" for name in scene.left_out)
            notes.append(f"levels of detail that are hidden from renders are not exported: {named}")
        uneven = [
            f"{page.shape[1]} × {page.shape[0]}" for page in pages if page.shape[0] % 4 or page.shape[1] % 4
        ]
        if uneven:
            notes.append(f"a page of {uneven[0]} texels cannot be compressed: choose a multiple of 4")
        if shown.padding is not None and shown.padding < ENGINE_PADDING:
            notes.append(
                f"charts are {shown.padding} texels apart, enough for bilinear filters: for bicubic ones and "
                f"compressed textures bake with a padding of {ENGINE_PADDING}"
            )
        return cls(shown.light, pages, groups, mix, stems, tuple(notes), endings(form))

    @property
    def keeps_lamps(self) -> bool:
        """Whether lamps are not in the lightmap."""
        return self.light == "indirect"

    @property
    def ktx2_names(self) -> list[str]:
        """The names of the pages' files that scene.glb refers to."""
        return [f"{stem}{KTX2}" for stem in self.stems[0]]

    @property
    def file_names(self) -> list[str]:
        """The names of all files."""
        return [f"{stem}{ending}" for of in self.stems for stem in of for ending in self.endings]

    @property
    def sizes(self) -> dict[int, tuple[int, int]]:
        """Width and height of each page."""
        return {number: (page.shape[1], page.shape[0]) for number, page in enumerate(self.pages)}

    def files(self) -> tuple[dict[str, bytes], list[tuple[PageEntry, ...]]]:
        """Return the files of all pages, and what lightmaps.json says of them: by group as `stems`."""
        found: dict[str, bytes] = {}
        entries = []
        for stems, pages in zip(self.stems, (self.pages, *(each[2] for each in self.groups)), strict=True):
            entries.append(
                tuple(self._encoded(page, stem, found) for page, stem in zip(pages, stems, strict=True))
            )
        return found, entries

    def _encoded(self, page: Array, stem: str, files: dict[str, bytes]) -> PageEntry:
        """Add the files of a page, and return its entry."""
        height, width = page.shape[:2]
        entry = PageEntry(width, height, f"{stem}{EXR}", f"{stem}{KTX2}")
        files[entry.exr], files[entry.ktx2] = write_half_exr(page), write_ktx2(page)
        if RGBM in self.endings:
            name = f"{stem}{RGBM}"
            files[name], largest = write_rgbm(page)
            entry = replace(entry, rgbm=name, rgbm_range=largest)
        return entry

    def index(
        self,
        scene: ExportScene,
        places: Mapping[str, LightmapPlace],
        entries: Sequence[tuple[PageEntry, ...]],
    ) -> LightmapIndex:
        """Return what lightmaps.json says.

        places: Of objects that share a mesh.
        entries: Of the files' pages.
        """
        groups = [
            GroupEntry(name, factor, of)
            for (name, factor, _), of in zip(self.groups, entries[1:], strict=True)
        ]
        nodes = []
        for name, page in scene.baked.items():
            place = places.get(name, LightmapPlace((1.0, 1.0), (0.0, 0.0)))
            nodes.append(NodeEntry(name, page, scale=place.scale, offset=place.offset))
        lamps = [] if self.keeps_lamps else lamps_in(scene.objects)
        return LightmapIndex(self.light, entries[0], nodes, groups, lamps, EFFICACY, self.notes, scene.view)
