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
import numpy as np

from ...bake.result import BakeReport
from ...base import BakeError, Status, staged
from ...exports import (
    INDEX_NAME,
    Glb,
    emission_images,
    emissive_only,
    lightmap_index,
    png_of_linear,
    resampled,
    share_meshes,
    static_files,
    viewer_page,
    with_lightmaps,
    write_ktx2,
)
from ...files import PLAIN_NAMES, export_record, older_files
from ...numerics import Array
from ...options import Form
from ..cycles.world import seen_background
from ..datablocks.quiet_output import silenced
from ..files.output import OutputFolder
from ..scene_records.render_options import world_of
from .bake_units import bake_units
from .edits_since_bake import edits_since_bake
from .evaluated_colors import evaluate_channel, image_of, side_factor
from .export_materials import ALPHA, BASE, CHANNELS, EMISSION
from .export_scene import PREFIX, ExportScene, export_scene
from .exported_lightmaps import ExportedLightmaps, endings, rgbm_names

LIT, BAKED, VIEWER = "scene.glb", "scene_baked.glb", "viewer.html"
BACKGROUND = "background.ktx2"
"""In viewer.html: what is behind all objects, around, row 0 at the lowest latitude."""

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
    return [*fixed, *static_files(form), *(f"{stem}{ending}" for ending in endings(form))]


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
            light = ExportedLightmaps.of(scene, form)
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
            images, entries = light.files()
            files |= images
            files[INDEX_NAME] = lightmap_index(light.index(scene, places, entries)).encode()
            if form.lit_scene:
                yield Status("baked glTF", 0.8)
                files[BAKED] = _baked(scene, light, colors, written).to_bytes()
        if form.viewer:
            yield Status("background", 0.85)
            inside = {LIT: files[LIT], INDEX_NAME: files[INDEX_NAME], **_background(context)}
            inside |= {name: data for name, data in images.items() if name.endswith(".ktx2")}
            files[VIEWER] = viewer_page(context.scene.name, inside)
        yield Status("write", 0.9)
        for name, data in files.items():
            _write(output.staging / name, data)
        left = {BAKED, VIEWER, *rgbm_names(light.stems)} - files.keys()
        record = export_record(output.earlier, form.names, lightmaps, light.mix, left)
        output.write_report(BakeReport({"version": REPORT_VERSION, **record}))
        output.publish()
        older = older_files(record, output.path)
        kept = sorted(name for name in left.difference(older) if (output.path / name).is_file())
    notes = [f"{name} is of earlier lightmaps" for name in older]
    notes += [f"{name} stays as an earlier export wrote it" for name in kept]
    return ExportReport(tuple(sorted(files)), (*edits, *light.notes, *notes))


def _write(path: Path, data: bytes) -> None:
    """Write a file; an OSError names it also where the disk is full."""
    try:
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(data)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error


def _background(context: bpy.types.Context) -> dict[str, bytes]:
    """Return the file of what a render shows behind all objects; none where that is transparent."""
    if context.scene.render.film_transparent:
        return {}
    return {BACKGROUND: write_ktx2(seen_background(world_of(context)).astype(np.float32))}


_Colors = dict[str, list[Array]]


def _evaluated(
    context: bpy.types.Context, scene: ExportScene, light: ExportedLightmaps, *, every: bool
) -> _Colors:
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
    _show_images(
        scene, _evaluated(context, scene, ExportedLightmaps.of(scene, Form((), sum_groups=True)), every=False)
    )


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
                # Lightmaps show the light of this frame and pose.
                export_current_frame=True,
                export_rest_position_armature=False,
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


def _baked(scene: ExportScene, light: ExportedLightmaps, colors: _Colors, written: Glb) -> Glb:
    """Return the file whose surfaces emit what leaves them."""
    radiance, factors = {}, {}
    for number, page in enumerate(light.pages):
        base = colors[BASE][number]
        radiance[number] = base * resampled(page, base.shape[1], base.shape[0])
        if EMISSION in colors:  # black where nothing glows
            radiance[number] += colors[EMISSION][number]
        factors[number] = base.shape[1] // page.shape[1]
    images, read_by = emission_images(written, scene.names, radiance, factors)
    encoded = [(png_of_linear(image.colors), image.white) for image in images]
    return emissive_only(written, scene.names, encoded, read_by)
