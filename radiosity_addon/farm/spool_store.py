"""Files of a spool: objects and arrays under the digests of their content, and others that are replaced.

Everything is written aside and renamed, and checked by its digest when it is read.
"""

from __future__ import annotations

import contextlib
import os
import re
import uuid
import weakref
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base import BakeError
from .objects import KINDS, ObjectError, array_digest, digest_of

Array = npt.NDArray[Any]

DIGEST = re.compile(r"[0-9a-f]{40}")

MOST_BYTES = 1 << 30
"""Of an object or a call, which are JSON."""


class SpoolStore:
    """Objects and arrays in a folder; see `objects.Store`.

    path: The folder.
    input_bytes: Of objects, arrays and calls that were written through it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path.expanduser().resolve()
        self.input_bytes = 0
        self._arrays: weakref.WeakValueDictionary[str, Array] = weakref.WeakValueDictionary()
        self._written: set[str] = set()

    def put_object(self, digest: str, text: str) -> None:
        """See `Store`."""
        self._keep(self._at("objects", digest, ".json"), text.encode())

    def object(self, digest: str) -> str:
        """See `Store`."""
        text = self._read(self._at("objects", digest, ".json")).decode(errors="replace")
        if digest_of(text) != digest:
            raise ObjectError(f"object {digest} is damaged")
        return text

    def put_array(self, array: Array) -> str:
        """See `Store`."""
        array = np.ascontiguousarray(array)
        digest = array_digest(array)
        path = self._at("arrays", digest, ".npy")
        with explained(self.path):
            is_there = path.exists()
        if not is_there or not self._is_whole(digest):
            with self._replacing(path) as aside, aside.open("wb") as file:
                np.save(file, array, allow_pickle=False)
            self.input_bytes += array.nbytes
            if not is_there:
                self._written.add(digest)
        return digest

    def remove_array(self, digest: str, others: bool) -> None:
        """Remove an array.

        others: What was not written through this store may be needed by others, and stays.
        """
        path = self._at("arrays", digest, ".npy")
        if (others and digest not in self._written) or path.parent.is_symlink():
            return
        self._written.discard(digest)
        # Where files cannot be removed while somebody reads them, it stays.
        with contextlib.suppress(OSError):
            path.unlink()

    def _is_whole(self, digest: str) -> bool:
        try:
            self._read_array(digest)
        except ObjectError:
            return False
        return True

    def array(self, digest: str) -> Array:
        """See `Store`; it stays in its file, and is checked when it is first read."""
        found = self._arrays.get(digest)
        if found is None:
            found = self._arrays[digest] = self._read_array(digest)
        return found

    def _read_array(self, digest: str) -> Array:
        path = self._at("arrays", digest, ".npy")
        try:
            _check_own(path)
            found = np.load(path, mmap_mode="r", allow_pickle=False)
        except (OSError, ValueError, EOFError) as error:
            raise ObjectError(f"array {digest}: {error}") from error
        array = np.asarray(found)
        if array.dtype.kind not in KINDS or array_digest(array) != digest:
            raise ObjectError(f"array {digest} is damaged")
        return array

    @staticmethod
    def check_digest(digest: Any) -> None:
        """Refuse what is no digest. Raises ObjectError."""
        if not isinstance(digest, str) or not DIGEST.fullmatch(digest):
            raise ObjectError("a name that is no digest")

    def _at(self, folder: str, digest: str, suffix: str = "") -> Path:
        self.check_digest(digest)
        return self.path / folder / f"{digest}{suffix}"

    def pointer(self, name: str) -> str | None:
        """Return the digest that a file holds; None if it is not there, or holds none."""
        path = self.path / name
        with contextlib.suppress(OSError, ValueError):
            if is_own(path):
                with path.open("rb") as file:
                    digest = file.read(64).decode().strip()
                return digest if DIGEST.fullmatch(digest) else None
        return None

    def point(self, name: str, digest: str) -> None:
        """Have a file hold a digest."""
        self._write(self.path / name, digest.encode())

    @contextlib.contextmanager
    def aside(self) -> Iterator[Path]:
        """Yield a path to write a file to that is gone at the end."""
        path = self.path / "aside" / uuid.uuid4().hex
        try:
            yield path
        finally:
            with contextlib.suppress(OSError):
                path.unlink()

    def _read(self, path: Path) -> bytes:
        try:
            _check_own(path)
            if path.exists() and path.stat().st_size > MOST_BYTES:
                raise ObjectError(f"'{path}' is no file of ours")
            return path.read_bytes()
        except OSError as error:
            raise ObjectError(f"'{path}' cannot be read: {error.strerror}") from error

    def _keep(self, path: Path, content: bytes) -> None:
        """Write a file, if it is not there or damaged."""
        with contextlib.suppress(ObjectError):
            if self._read(path) == content:
                return
        self._write(path, content)
        self.input_bytes += len(content)

    def _write(self, path: Path, content: bytes) -> None:
        with self._replacing(path) as aside:
            aside.write_bytes(content)

    @contextlib.contextmanager
    def _replacing(self, path: Path) -> Iterator[Path]:
        """Yield where to write a file that is then put in its place, or removed if it cannot be written."""
        name = uuid.uuid4().hex
        aside = path.with_name(f".{name}") if path.parent == self.path else self.path / "aside" / name
        with explained(self.path):
            for folder in (path.parent.parent, path.parent, aside.parent):
                if folder.is_relative_to(self.path) and folder != self.path and folder.is_symlink():
                    raise linked(folder)
            try:
                yield aside
                aside.replace(path)
            except BaseException:
                with contextlib.suppress(OSError):
                    aside.unlink()
                raise


def is_own(path: Path) -> bool:
    """Return whether a file may be ours: a link may lead out of the spool, a device or a pipe have no end."""
    return path.is_file() and not path.is_symlink()


def _check_own(path: Path) -> None:
    """Refuse what is there and is no file of ours. Raises ObjectError."""
    if os.path.lexists(path) and not is_own(path):
        raise ObjectError(f"'{path}' is no file of ours")


def linked(path: Path) -> BakeError:
    """Return the error for a folder of a spool that lies elsewhere."""
    return BakeError(f"'{path}' is a link out of the spool: remove it")


@contextlib.contextmanager
def explained(path: Path) -> Iterator[None]:
    """Raise a BakeError that names the spool for errors of the system."""
    try:
        yield
    except OSError as error:
        raise not_written(path, error) from error


def not_written(path: Path, error: OSError) -> BakeError:
    """Return the error for a spool that cannot be written to."""
    why = error.strerror or "its disk may be full"  # NumPy tells no more
    return BakeError(f"cannot write to spool '{path}': {why}; see to it and start again")
