"""Sidecars whose digest is right and whose content is not: huge, of wrong shape, NaN, out of bounds.

The layout of the file is written down here once more, from the outside: a head, a description in JSON,
and compressed blocks of arrays.
"""

from __future__ import annotations

import hashlib
import json
import struct
import zlib
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

HEAD = struct.Struct("<16sI32sQ")
BLOCK = 1 << 22


def damage_arrays(path: Path, random: Random) -> str:
    """Rewrite a sidecar with something wrong in it; a file that is not of the layout is cut."""
    content = path.read_bytes()
    try:
        magic, version, _, length = HEAD.unpack_from(content)
        told = json.loads(zlib.decompress(content[HEAD.size : HEAD.size + length]))
        body = content[HEAD.size + length :]
    except (struct.error, zlib.error, ValueError):
        path.write_bytes(content[: len(content) // 2])
        return "cut: its layout is another"
    kind = random.choice(
        ("bomb", "shape", "numbers", "numbers", "numbers", "indices", "indices", "words", "version")
    )
    if kind == "version":
        version += random.choice((1, 1000))
        kind = f"version {version}"
    elif kind == "words":
        kind = f"words {_break_words(told, random)}"
    elif kind == "shape":
        entry = random.choice(told["arrays"])
        entry["shape"] = random.choice(
            ([], [0], [-1], [*entry["shape"], 1], entry["shape"][::-1], [2**40], "x", [1.5])
        )
    elif kind == "bomb":
        body = _bomb(told, body, random)
    else:
        body, where = _change(told, body, random, kind)
        kind = f"{kind} {where}"
    head = zlib.compress(json.dumps(told).encode())
    digest = hashlib.blake2b(head + body, digest_size=32).digest()
    path.write_bytes(HEAD.pack(magic, version, digest, len(head)) + head + body)
    return kind


def _break_words(told: Any, random: Random) -> str:
    """Put an odd value somewhere into the description."""
    node, path = told["description"], []
    while True:
        keys = list(node) if isinstance(node, dict) else list(range(len(node)))
        key = random.choice(keys)
        path.append(str(key))
        inner = node[key]
        if isinstance(inner, dict | list) and inner and random.random() < 0.9:
            node = inner
            continue
        node[key] = random.choice(
            (-1, 2**40, 1e300, float("nan"), None, "text", [], {"object": ["Links", {}]}, {"array": 10**6})
        )
        return "/".join(path)[-60:]


def _bomb(told: Any, body: bytes, random: Random) -> bytes:
    """Have an array be very large: zeros compress a thousandfold."""
    sizes = [sum(entry["blocks"]) for entry in told["arrays"]]
    number = random.choice([n for n, size in enumerate(sizes) if size])
    entry = told["arrays"][number]
    width = np.dtype(entry["kind"]).itemsize
    blocks = random.choice((300, 1000))
    block = zlib.compress(bytes(BLOCK), 9)
    rows = entry["shape"][1:]
    count = blocks * (BLOCK // width)
    entry["shape"] = [count // max(1, int(np.prod(rows))), *rows]
    entry["blocks"] = [len(block)] * blocks
    start = sum(sizes[:number])
    return body[:start] + block * blocks + body[start + sizes[number] :]


def _change(told: Any, body: bytes, random: Random, kind: str) -> tuple[bytes, str]:
    """Change numbers of an array: fractions to NaN, infinity or less than nothing; indices out of bounds."""
    wanted = "float" if kind == "numbers" else "int"
    numbers = [
        n for n, entry in enumerate(told["arrays"]) if wanted in entry["kind"] and len(entry["blocks"]) == 1
    ]
    number = random.choice(numbers)
    entry = told["arrays"][number]
    start = sum(sum(each["blocks"]) for each in told["arrays"][:number])
    block = body[start : start + entry["blocks"][0]]
    dtype = np.dtype(entry["kind"])
    planes = np.frombuffer(zlib.decompress(block), np.uint8).reshape(dtype.itemsize, -1)
    values = np.ascontiguousarray(planes.T).view(dtype).reshape(-1).copy()
    odd = (np.nan, np.inf, -1e3, -1.0, 1e30) if kind == "numbers" else (-1, -(2**30), 2**30, len(values) + 10)
    value = random.choice(odd)
    chosen = np.array([random.randrange(len(values)) for _ in range(random.choice((1, 10, 100)))])
    if random.random() < 0.2:
        chosen = np.arange(len(values))
    with np.errstate(over="ignore", invalid="ignore"):
        values[chosen] = np.array(value).astype(dtype)
    made = zlib.compress(
        np.ascontiguousarray(values.view(np.uint8).reshape(-1, dtype.itemsize).T).tobytes(), 1
    )
    entry["blocks"] = [len(made)]
    return body[:start] + made + body[start + len(block) :], f"array {number} {value}"
