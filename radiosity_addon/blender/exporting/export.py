"""An export: the scene that shows lightmaps, written into a folder in the forms that engines read.

The verb `export`, the option `--export` and the button *Export* all run this.
"""

from __future__ import annotations

import os
import re
from collections.abc import Generator, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import addon_utils  # type: ignore[import-not-found]
import bpy

from ...bake.result import BakeReport
from ...base import BakeError, Status, staged
from ...exports import (
    INDEX_NAME,
    Glb,
    GroupEntry,
    LightmapIndex,
    LightmapPlace,
    NodeEntry,
    PageEntry,
    emissive_only,
    lightmap_index,
    png_of_linear,
    resampled,
    share_meshes,
    static_files,
    viewer_page,
    with_lightmaps,
    write_half_exr,
    write_ktx2,
)
from ...files import PLAIN_NAMES, export_record, older_files, unique_names
from ...numerics import Array
from ...options import EFFICACY, ENGINE_PADDING, Form
from ..datablocks.quiet_output import silenced
from ..files.output import OutputFolder
from .bake_units import bake_units
from .edits_since_bake import edits_since_bake
from .evaluated_colors import evaluate_channel, image_of, side_factor
from .export_materials import ALPHA, BASE, CHANNELS, EMISSION
from .export_scene import PREFIX, ExportScene, export_scene, lamps_in
from .shown_lightmaps import light_of

LIT, BAKED, VIEWER = "scene.glb", "scene_baked.glb", "viewer.html"
REPORT_VERSION = 1


@dataclass(frozen=True)
class ExportReport:
    """What was written: the names of the files, and what to know."""

    files: tuple[str, ...]
    notes: tuple[str, ...] = ()


def foreseen_files(form: Form) -> list[str]:
    """Return the names of the files that an export writes in any case."""
    fixed = [LIT, INDEX_NAME, *([BAKED] if form.lit_scene else []), *([VIEWER] if form.viewer else [])]
    (stem,) = PLAIN_NAMES.shared_pages(1)
    return [*fixed, *static_files(form), f"{stem}.exr", f"{stem}.ktx2"]


def run_export(
    context: bpy.types.Context,
    form: Form,
    folder: OutputFolder,
    lightmaps: Mapping[str, str],
    *,
    compare: bool = True,
    in_background: bool = False,
) -> Generator[Status, None, ExportReport]:
    """Export the context's scene into a folder; all files are there at once, or none.

    lightmaps: Digests of the files of the lightmaps that are shown, for the report.
    compare: Whether the scene may have been edited since the bake: the report says what was.
    in_background: Whether a window waits.

    Raises
    ------
    RadiosityError
        If the scene shows no lightmap that can be exported, or a file cannot be written.
    """
    with folder as output:
        output.expect(foreseen_files(form))
        files = static_files(form)
        yield Status("export", 0.0)
        edits: list[str] = []
        if compare:
            edits = yield from staged(edits_since_bake(context, in_background), "compare", 0.0, 0.1)
        with closing(export_scene(context)) as scene:
            light = _Lightmaps.of(scene, sum_groups=form.sum_groups)
            output.expect(light.file_names)
            yield Status("colors", 0.1)
            colors = _evaluated(context, scene, light, every=form.lit_scene)
            yield Status("glTF", 0.4)
            _show_images(scene, colors)
            written = _gltf(context, scene, output.staging, keeps_lamps=light.keeps_lamps)
            shared, places = share_meshes(written, scene.names, scene.baked, light.sizes)
            lit = with_lightmaps(
                shared, scene.names, dict(enumerate(light.ktx2_names)), lamps=light.keeps_lamps
            )
            files[LIT] = lit.to_bytes()
            yield Status("lightmaps", 0.6)
            images = light.files()
            files |= images
            files[INDEX_NAME] = lightmap_index(light.index(scene, places)).encode()
            if form.lit_scene:
                yield Status("baked glTF", 0.8)
                pages = _light_pages(scene, light, colors)
                files[BAKED] = emissive_only(written, scene.names, pages).to_bytes()
        if form.viewer:
            shown = {name: data for name, data in images.items() if name.endswith(".ktx2")}
            inside = {LIT: files[LIT], INDEX_NAME: files[INDEX_NAME], **shown}
            files[VIEWER] = viewer_page(context.scene.name, inside)
        yield Status("write", 0.9)
        for name, data in files.items():
            path = output.staging / name
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(data)
        left = {BAKED, VIEWER} - files.keys()
        record = export_record(output.earlier, form.names, lightmaps, light.mix, left)
        output.write_report(BakeReport({"version": REPORT_VERSION, **record}))
        output.publish()
        older = [f"{name} is of earlier lightmaps" for name in older_files(record, output.path)]
    return ExportReport(tuple(sorted(files)), (*edits, *light.notes, *older))


@dataclass(frozen=True, eq=False)
class _Lightmaps:
    """The pages of an export as arrays, and the names of their files.

    groups: Light groups that have lightmaps of their own, with their factors.
    mix: The factors of all light groups.
    """

    light: str
    pages: tuple[Array, ...]
    groups: tuple[tuple[str, tuple[float, float, float], tuple[Array, ...]], ...]
    mix: dict[str, tuple[float, float, float]]
    stems: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...]

    @classmethod
    def of(cls, scene: ExportScene, *, sum_groups: bool) -> _Lightmaps:
        shown = scene.shown
        pages = tuple(shown.page(number) for number in range(len(shown.images)))
        groups = tuple(
            (group.name, group.factor, tuple(map(light_of, group.images)))
            for group in (() if sum_groups else shown.groups)
        )
        mix = {group.name: group.factor for group in shown.groups}
        taken: set[str] = set()
        names = [PLAIN_NAMES.shared_pages(len(pages), group) for group in ("", *(each[0] for each in groups))]
        stems = tuple(tuple(unique_names(of, "", taken)) for of in names)
        notes = list(dict.fromkeys(note for material in scene.materials for note in material.notes))
        if shown.light == "indirect":
            notes.append("the lightmap holds indirect light: lamps are exported, but glTF has no area lamps")
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
        return cls(shown.light, pages, groups, mix, stems, tuple(notes))

    @property
    def keeps_lamps(self) -> bool:
        """Whether lamps are not in the lightmap."""
        return self.light == "indirect"

    @property
    def ktx2_names(self) -> list[str]:
        return [f"{stem}.ktx2" for stem in self.stems[0]]

    @property
    def file_names(self) -> list[str]:
        return [f"{stem}{ending}" for of in self.stems for stem in of for ending in (".exr", ".ktx2")]

    @property
    def sizes(self) -> dict[int, tuple[int, int]]:
        """Width and height of each page."""
        return {number: (page.shape[1], page.shape[0]) for number, page in enumerate(self.pages)}

    def files(self) -> dict[str, bytes]:
        """Return the files of all pages."""
        found = {}
        for stems, pages in zip(self.stems, (self.pages, *(each[2] for each in self.groups)), strict=True):
            for stem, page in zip(stems, pages, strict=True):
                found[f"{stem}.exr"], found[f"{stem}.ktx2"] = write_half_exr(page), write_ktx2(page)
        return found

    def index(self, scene: ExportScene, places: Mapping[str, LightmapPlace]) -> LightmapIndex:
        """Return what lightmaps.json says.

        places: Of objects that share a mesh.
        """
        entries = [
            tuple(_entry(page, stem) for page, stem in zip(pages, stems, strict=True))
            for stems, pages in zip(self.stems, (self.pages, *(each[2] for each in self.groups)), strict=True)
        ]
        groups = [
            GroupEntry(name, factor, of)
            for (name, factor, _), of in zip(self.groups, entries[1:], strict=True)
        ]
        nodes = []
        for name, page in scene.baked.items():
            place = places.get(name, LightmapPlace((1.0, 1.0), (0.0, 0.0)))
            nodes.append(NodeEntry(name, page, scale=place.scale, offset=place.offset))
        lamps = [] if self.keeps_lamps else lamps_in(scene.objects)
        return LightmapIndex(self.light, entries[0], nodes, groups, lamps, EFFICACY, self.notes)


def _entry(page: Array, stem: str) -> PageEntry:
    height, width = page.shape[:2]
    return PageEntry(width, height, f"{stem}.exr", f"{stem}.ktx2")


_Colors = dict[str, list[Array]]


def _evaluated(context: bpy.types.Context, scene: ExportScene, light: _Lightmaps, *, every: bool) -> _Colors:
    """Return the channels that are needed, each on all pages: every color, or what glTF cannot express."""
    needed = {channel for each in scene.materials for channel in each.evaluated}
    if every:
        needed |= {BASE} | ({EMISSION} if any(each.glows for each in scene.materials) else set())
    sizes = []
    for page in light.pages:
        height, width = page.shape[:2]
        factor = side_factor(max(width, height))
        sizes.append((factor * width, factor * height))
    if not needed:
        return {}
    with bake_units(scene) as objects:
        return {
            channel: evaluate_channel(context, scene, objects, sizes, channel)
            for channel in CHANNELS
            if channel in needed
        }


def evaluated_materials(context: bpy.types.Context, scene: ExportScene) -> None:
    """Have the temporary scene's materials read images of what glTF cannot express of them."""
    _show_images(scene, _evaluated(context, scene, _Lightmaps.of(scene, sum_groups=True), every=False))


def _show_images(scene: ExportScene, colors: _Colors) -> None:
    """Have materials read what was evaluated of them."""
    for page in range(len(scene.shown.images)):
        of_page = [each for each in scene.materials if each.page == page and each.evaluated]
        needed = {channel for each in of_page for channel in each.evaluated}
        if not needed:
            continue
        channels = {channel: colors[channel][page] for channel in needed}
        images, made = image_of(channels, f"Page {page}")
        scene.made += made
        alpha = channels.get(ALPHA)
        for material in of_page:
            material.is_cut_out = alpha is not None and bool(((alpha > 0.02) & (alpha < 0.98)).mean() < 0.02)
            material.show_images(images)


def _gltf(context: bpy.types.Context, scene: ExportScene, folder: Path, *, keeps_lamps: bool) -> Glb:
    """Let Blender write the temporary scene, and read it back."""
    if addon_utils.check("io_scene_gltf2")[1] is False:
        addon_utils.enable("io_scene_gltf2", default_set=False)
    path = folder / f".{PREFIX}scene.glb"
    try:
        with (
            _window_kept(context),
            silenced(),
            context.temp_override(scene=scene.scene, view_layer=scene.scene.view_layers[0]),
        ):
            bpy.ops.export_scene.gltf(
                filepath=str(path),
                export_format="GLB",
                use_active_scene=True,
                export_apply=True,
                export_extras=True,
                export_cameras=True,
                export_lights=keeps_lamps,
                export_animations=False,
                export_import_convert_lighting_mode="SPEC",
            )
        written = path.read_bytes()
    except RuntimeError as error:
        raise _failure(str(error), folder / LIT) from error
    finally:
        path.unlink(missing_ok=True)
    return Glb.of_bytes(written)


def _failure(message: str, path: Path) -> OSError | BakeError:
    """Return what Blender's exporter failed of: its message is a traceback."""
    system = re.search(r"\[Errno (\d+)\]", message)
    if system is not None:
        return OSError(int(system[1]), os.strerror(int(system[1])), str(path))
    said = re.findall(r"^\s*(\w+(?:Error|Exception)\b.*)$", message, re.MULTILINE)
    return BakeError(f"Blender's glTF exporter failed: {' '.join((said or [message])[-1].split())}")


@contextmanager
def _window_kept(context: bpy.types.Context) -> Iterator[None]:
    """Put scene and view layer of the window back, which Blender's exporter sets to those that it writes."""
    window, scene, layer = context.window, context.scene, context.view_layer
    try:
        yield
    finally:
        if window is not None:
            window.scene = scene
            window.view_layer = layer


def _light_pages(
    scene: ExportScene, light: _Lightmaps, colors: _Colors
) -> dict[tuple[int, bool], tuple[bytes, float]]:
    """Return the images of what leaves surfaces, for each page, and for glowing materials apart."""
    found = {}
    for number, page in enumerate(light.pages):
        base = colors[BASE][number]
        leaving = base * resampled(page, base.shape[1], base.shape[0])
        for glows in {each.glows for each in scene.materials if each.page == number}:
            radiance = leaving
            if glows:
                radiance = leaving + colors[EMISSION][number]
            white = max(float(radiance.max(initial=0.0)), 1e-6)
            found[number, glows] = png_of_linear(radiance / white), white
    return found
