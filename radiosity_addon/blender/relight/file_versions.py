"""Earlier versions of files, held as long as somebody may want them back: known by their digests."""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
from collections import OrderedDict
from pathlib import Path

from ...base import BakeError

MOST_FILES, MOST_BYTES = 128, 2 << 30
"""So many files and bytes are held; the oldest are dropped first."""

FREE = 4
"""Held files take at most this fraction of the free space: 1 / SHARE."""

_CHUNK = 1 << 20


class HeldFiles:
    """Files in a folder of their own, by the SHA-256 of their bytes.

    Parameters
    ----------
    parent : Path
        Where the folder is made, once it is needed.
    """

    def __init__(self, parent: Path, most_files: int = MOST_FILES, most_bytes: int = MOST_BYTES) -> None:
        self._parent, self._most_files, self._most_bytes = parent, most_files, most_bytes
        self._folder: Path | None = None
        self._sizes: OrderedDict[str, int] = OrderedDict()

    def __contains__(self, digest: str) -> bool:
        return digest in self._sizes

    def __len__(self) -> int:
        return len(self._sizes)

    @property
    def nbytes(self) -> int:
        """What they take on the disk."""
        return sum(self._sizes.values())

    def hold(self, path: Path, digest: str) -> bool:
        """Hold a file that is about to be replaced; False where there is no room for it, or no such file."""
        if digest in self._sizes:
            self._sizes.move_to_end(digest)
            return True
        try:
            if self._folder is None:
                self._folder = Path(tempfile.mkdtemp(prefix="radiosity-versions-", dir=self._parent))
            size, place = path.stat().st_size, self._folder / digest
            if size > min(self._most_bytes, shutil.disk_usage(self._folder).free // FREE):
                return False
            try:
                os.link(path, place)
            except OSError:
                shutil.copyfile(path, place)
        except OSError:
            return False
        self._sizes[digest] = size
        while len(self._sizes) > self._most_files or self.nbytes > self._most_bytes:
            self.drop(next(iter(self._sizes)))
        return digest in self._sizes

    def copy_to(self, digest: str, target: Path) -> None:
        """Copy a file that is held; it must still be as it was.

        Raises
        ------
        BakeError
            If it is not held, was changed, or the copy cannot be written.
        """
        if self._folder is None or digest not in self._sizes:
            raise BakeError(f"the earlier version of '{target.name}' is no longer available: bake again")
        found = hashlib.sha256()
        try:
            with (self._folder / digest).open("rb") as source, target.open("wb") as copy:
                while chunk := source.read(_CHUNK):
                    found.update(chunk)
                    copy.write(chunk)
        except OSError as error:
            raise BakeError(f"cannot write '{target.name}': {error.strerror}") from error
        if found.hexdigest() != digest:
            self.drop(digest)
            raise BakeError(f"the earlier version of '{target.name}' was changed: bake again")

    def drop(self, digest: str) -> None:
        """Hold a file no more."""
        if self._sizes.pop(digest, None) is not None and self._folder is not None:
            (self._folder / digest).unlink(missing_ok=True)

    def close(self) -> None:
        """Hold none any more, and remove the folder."""
        self._sizes.clear()
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
        self._folder = None
