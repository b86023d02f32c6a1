"""Files that are held come back to the byte, and no more of them are held than there is room for."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import pytest

from radiosity_addon.base.errors import BakeError
from radiosity_addon.blender.relight.file_versions import HeldFiles


def write(path: Path, content: bytes) -> str:
    path.write_bytes(content)
    return hashlib.sha256(content).hexdigest()


@pytest.mark.parametrize("links", [True, False])
def test_a_file_comes_back_after_it_was_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, links: bool
) -> None:
    """Also across file systems, where there are no hard links."""
    if not links:
        monkeypatch.setattr(os, "link", lambda *_: (_ for _ in ()).throw(OSError(18, "other device")))
    held, path = HeldFiles(tmp_path), tmp_path / "lightmap.exr"
    first = write(path, b"first")
    assert held.hold(path, first)
    write(tmp_path / "new", b"second")
    (tmp_path / "new").replace(path)
    held.copy_to(first, tmp_path / "back")
    assert (tmp_path / "back").read_bytes() == b"first"
    assert path.read_bytes() == b"second"
    held.close()
    assert sorted(item.name for item in tmp_path.iterdir()) == ["back", "lightmap.exr"]


def test_what_was_changed_or_is_gone_does_not_come_back(tmp_path: Path) -> None:
    held, path = HeldFiles(tmp_path), tmp_path / "lightmap.exr"
    first = write(path, b"first")
    assert held.hold(path, first)
    path.write_bytes(b"in place")  # of the same file: not by a bake, but who knows
    with pytest.raises(BakeError, match=r"'back'.*changed"):
        held.copy_to(first, tmp_path / "back")
    assert first not in held
    with pytest.raises(BakeError, match=r"'back'.*available"):
        held.copy_to(first, tmp_path / "back")
    assert not held.hold(tmp_path / "nothing", "0" * 64)


def test_the_oldest_go_first(tmp_path: Path) -> None:
    held = HeldFiles(tmp_path, most_files=3, most_bytes=1000)
    digests = []
    for number in range(5):
        path = tmp_path / f"{number}"
        digests.append(write(path, bytes([number]) * 10))
        assert held.hold(path, digests[-1])
        held.hold(tmp_path / "0", digests[0])  # seen last again and again
    assert [digest in held for digest in digests] == [True, False, False, True, True]
    big = write(tmp_path / "big", bytes(990))
    assert held.hold(tmp_path / "big", big)
    assert (len(held), held.nbytes) == (2, 1000)
    assert not held.hold(tmp_path / "big", write(tmp_path / "big", bytes(1001)))
    assert big in held


def test_a_folder_that_cannot_be_made_holds_nothing(tmp_path: Path) -> None:
    digest = write(tmp_path / "file", b"content")
    held = HeldFiles(tmp_path / "missing")
    assert not held.hold(tmp_path / "file", digest)
    held.close()
