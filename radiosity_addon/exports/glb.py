"""Binary glTF as JSON and the bytes of its buffer views: read, pruned, equal parts merged, written.

After the "glTF 2.0 Specification" (Khronos Group), section 4.4. Only what one buffer holds is read.
"""

from __future__ import annotations

import hashlib
import json
import struct
from collections.abc import Iterator
from typing import Any

MAGIC, VERSION = 0x46546C67, 2
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942

Json = dict[str, Any]

_KINDS = ("meshes", "skins", "materials", "textures", "images", "samplers", "accessors", "bufferViews")
"""What is removed where nothing uses it; what a kind uses comes after it."""


class GlbError(ValueError):
    """A file is not binary glTF with one buffer."""


class Glb:
    """A binary glTF file that can be changed.

    json: Its JSON, without buffers; buffer views have no place in one.
    views: The bytes of each buffer view.
    """

    def __init__(self, json: Json, views: list[bytes]) -> None:
        self.json, self.views = json, views

    @classmethod
    def of_bytes(cls, file: bytes) -> Glb:
        """Read a file; raises GlbError if it is anything else."""
        try:
            magic, version, length = struct.unpack_from("<3I", file)
            if (magic, version) != (MAGIC, VERSION) or length > len(file):
                raise GlbError("not a binary glTF 2.0 file")
            size, kind = struct.unpack_from("<2I", file, 12)
            content = json.loads(file[20 : 20 + size])
            binary = b""
            if len(file) >= 28 + size:
                binary_size, _ = struct.unpack_from("<2I", file, 20 + size)
                binary = file[28 + size : 28 + size + binary_size]
            if kind != JSON_CHUNK or any("uri" in buffer for buffer in content.get("buffers", ())):
                raise GlbError("not a binary glTF file with a buffer of its own")
            views = []
            for view in content.get("bufferViews", ()):
                first = view.pop("byteOffset", 0)
                views.append(binary[first : first + view["byteLength"]])
        except (struct.error, ValueError, KeyError, TypeError) as error:
            raise error if isinstance(error, GlbError) else GlbError("not a binary glTF file") from error
        content.pop("buffers", None)
        return cls(content, views)

    def to_bytes(self) -> bytes:
        """Return the file; equal contents give equal bytes."""
        offset, places, parts = 0, [], []
        for view, data in zip(self.json.get("bufferViews", ()), self.views, strict=True):
            places.append({**view, "buffer": 0, "byteOffset": offset, "byteLength": len(data)})
            parts.append(data + bytes(-len(data) % 4))
            offset += len(parts[-1])
        content = {key: value for key, value in self.json.items() if value != [] or key == "scenes"}
        if places:
            content |= {"bufferViews": places, "buffers": [{"byteLength": offset}]}
        text = json.dumps(content, ensure_ascii=False, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<2I", len(text), JSON_CHUNK) + text
        if places:
            chunks += struct.pack("<2I", offset, BINARY_CHUNK) + b"".join(parts)
        return struct.pack("<3I", MAGIC, VERSION, 12 + len(chunks)) + chunks

    def copy(self) -> Glb:
        """Return a copy whose JSON can be changed apart."""
        return Glb(json.loads(json.dumps(self.json)), list(self.views))

    def add(self, kind: str, item: Json) -> int:
        """Append an item, such as a texture, and return its index."""
        items = self.json.setdefault(kind, [])
        items.append(item)
        return len(items) - 1

    def add_view(self, data: bytes) -> int:
        """Append a buffer view and return its index."""
        self.views.append(data)
        return self.add("bufferViews", {"buffer": 0, "byteLength": len(data)})

    def add_image(self, png: bytes, name: str) -> int:
        """Append a PNG image and return its index."""
        view = self.add_view(png)
        return self.add("images", {"name": name, "mimeType": "image/png", "bufferView": view})

    def uses(self, extension: str) -> None:
        """Declare an extension as used."""
        used = self.json.setdefault("extensionsUsed", [])
        if extension not in used:
            used.append(extension)

    def merge_equal(self) -> None:
        """Store equal buffer views, accessors, images, textures and meshes once each."""
        digests = [hashlib.sha256(data).hexdigest() for data in self.views]
        for view, digest in zip(self.json.get("bufferViews", ()), digests, strict=True):
            view["digest"] = digest
        for kind in ("bufferViews", "accessors", "images", "samplers", "textures", "materials", "meshes"):
            self._merge(kind)
        for view in self.json.get("bufferViews", ()):
            view.pop("digest", None)
        self.prune()

    def _merge(self, kind: str) -> None:
        """Let all references to equal items go to the first of them; materials keep their names."""
        first: dict[str, int] = {}
        target = []
        for number, item in enumerate(self.json.get(kind, ())):
            nameless = item if kind == "materials" else {k: v for k, v in item.items() if k != "name"}
            target.append(first.setdefault(json.dumps(nameless, sort_keys=True), number))
        for holder, key, of in list(self.references()):
            if of == kind:
                holder[key] = target[holder[key]]

    def prune(self) -> None:
        """Remove what nothing uses, and extensions that are no longer there."""
        for kind in _KINDS:
            items = self.json.get(kind)
            if items is None:
                continue
            places = [(holder, key) for holder, key, of in self.references() if of == kind]
            kept = sorted({holder[key] for holder, key in places})
            new = {old: number for number, old in enumerate(kept)}
            for holder, key in places:
                holder[key] = new[holder[key]]
            self.json[kind] = [items[old] for old in kept]
            if kind == "bufferViews":
                self.views = [self.views[old] for old in kept]
        present = set(_extensions(self.json))
        for listed in ("extensionsUsed", "extensionsRequired"):
            if listed in self.json:
                self.json[listed] = [name for name in self.json[listed] if name in present]

    def references(self) -> Iterator[tuple[Any, Any, str]]:
        """Yield (holder, key, kind) of each index into one of the kinds that are pruned."""
        content = self.json
        for node in content.get("nodes", ()):
            yield from _keys(node, {"mesh": "meshes", "skin": "skins"})
            instancing = node.get("extensions", {}).get("EXT_mesh_gpu_instancing", {})
            yield from _all(instancing.get("attributes", {}), "accessors")
        for skin in content.get("skins", ()):
            yield from _keys(skin, {"inverseBindMatrices": "accessors"})
        for animation in content.get("animations", ()):
            for sampler in animation["samplers"]:
                yield from _keys(sampler, {"input": "accessors", "output": "accessors"})
        for mesh in content.get("meshes", ()):
            for primitive in mesh["primitives"]:
                yield from _keys(primitive, {"indices": "accessors", "material": "materials"})
                for attributes in (primitive["attributes"], *primitive.get("targets", ())):
                    yield from _all(attributes, "accessors")
        for material in content.get("materials", ()):
            for info in texture_infos(material):
                yield info, "index", "textures"
        for texture in content.get("textures", ()):
            yield from _keys(texture, {"source": "images", "sampler": "samplers"})
            for extension in texture.get("extensions", {}).values():
                yield from _keys(extension, {"source": "images"})
        for image in content.get("images", ()):
            yield from _keys(image, {"bufferView": "bufferViews"})
        for accessor in content.get("accessors", ()):
            sparse = accessor.get("sparse", {})
            for holder in (accessor, sparse.get("indices", {}), sparse.get("values", {})):
                yield from _keys(holder, {"bufferView": "bufferViews"})


def texture_infos(value: Json, key: str = "") -> Iterator[Json]:
    """Yield the texture infos of a material, also those of its extensions."""
    if "index" in value and (key.endswith("Texture") or key == "MOZ_lightmap"):
        yield value
        return
    for name, inner in value.items():
        if isinstance(inner, dict) and name != "extras":
            yield from texture_infos(inner, name)


def _keys(holder: Json, kinds: dict[str, str]) -> Iterator[tuple[Json, str, str]]:
    for key, kind in kinds.items():
        if key in holder:
            yield holder, key, kind


def _all(holder: Json, kind: str) -> Iterator[tuple[Json, str, str]]:
    for key in holder:
        yield holder, key, kind


def _extensions(value: Any) -> Iterator[str]:
    """Yield the names of all extensions that are there."""
    if isinstance(value, dict):
        yield from value.get("extensions", {})
    for inner in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        yield from _extensions(inner)
