"""A bake that was prepared in a spool: all that it reads, and what is to become of its result.

Its inputs are an object under their digest, so the same scene and options are the same inputs wherever they
are exported. Next to them is what changes no byte of the lightmaps.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from typing import Any

from ..bake.relight import DAMAGED
from ..bake.sidecar import check_bake_scene, check_settings
from ..base import BakeError, RadiosityError, UsageError
from ..options import BakeSettings, Form, forms_of
from ..scene import BakeScene
from .identity import version_of
from .objects import DigestsAlone, ObjectError, Reader, Store, Writer, digest_of
from .spool import PREPARED, Spool

UNREADABLE = (*DAMAGED, RadiosityError)
"""What reading what another process has written can raise."""


@dataclass(frozen=True, eq=False)
class BakeInputs:
    """All that decides a bake's result.

    keep: Whether it is kept in a sidecar.
    """

    bake_scene: BakeScene
    settings: BakeSettings
    keep: bool

    def digest(self) -> str:
        """Return the digest of everything in it."""
        return digest_of(self._text(DigestsAlone()))

    def write(self, spool: Spool) -> str:
        """Write it to a spool; return its digest. Raises BakeError if it cannot be written."""
        text = self._text(spool)
        digest = digest_of(text)
        spool.put_object(digest, text)
        return digest

    @classmethod
    def read(cls, spool: Spool, digest: str) -> BakeInputs:
        """Read it from a spool.

        Raises BakeError if it is damaged, or this process would lay out charts differently.
        """
        try:
            stored = Reader(spool).value(json.loads(spool.object(digest)))
            xatlas, keep = str(stored["xatlas"]), stored["keep"] is True
            settings, bake_scene = _settings(stored["settings"]), stored["scene"]
            check_bake_scene(bake_scene)
        except UNREADABLE as error:
            raise damaged(spool, error) from error
        if xatlas != version_of("xatlas"):
            raise BakeError(
                f"spool '{spool.path}' was prepared with xatlas {xatlas}, here is {version_of('xatlas')}: "
                "the lightmap would not be the same bytes; use one version"
            )
        return cls(bake_scene, settings, keep)

    def _text(self, store: Store) -> str:
        tree = {"scene": self.bake_scene, "settings": asdict(self.settings), "keep": self.keep}
        return json.dumps(Writer(store).tree({**tree, "xatlas": version_of("xatlas")}))


@dataclass(frozen=True)
class PreparedBake:
    """What a spool says of the bake that was prepared in it.

    inputs: Their digest.
    keep: Whether a sidecar was asked for: where objects keep lightmaps of other bakes, none is written.
    preview: Whether a picture of the result is rendered.
    forms, sum_groups: What is exported afterwards; see `forms_of`.
    source: The file of the scene, or a word in angle brackets for the bundled one, …
    scene: … and the scene's name.
    """

    inputs: str
    settings: BakeSettings
    keep: bool = False
    preview: bool = True
    forms: str | None = None
    sum_groups: bool = False
    source: str = ""
    scene: str = ""

    def of(self, source: str, scene: str) -> PreparedBake:
        """Return the same of another scene."""
        return replace(self, source=source, scene=scene)

    @property
    def form(self) -> Form | None:
        """What is exported afterwards."""
        return None if self.forms is None else forms_of(self.forms, self.sum_groups)

    def write(self, spool: Spool) -> None:
        """Write it to a spool, which is prepared then. Raises BakeError if it cannot be written."""
        text = json.dumps(Writer(spool).tree(asdict(self)))
        digest = digest_of(text)
        spool.put_object(digest, text)
        spool.point(PREPARED, digest)

    @classmethod
    def read(cls, spool: Spool) -> PreparedBake | None:
        """Read it from a spool; None if nothing is prepared. Raises BakeError if it is damaged."""
        digest = spool.pointer(PREPARED)
        if digest is None:
            if (spool.path / PREPARED).exists():
                raise damaged(spool)
            return None
        try:
            stored = dict(Reader(spool).value(json.loads(spool.object(digest))))
            found = cls(**{**stored, "settings": _settings(stored["settings"])})
            found._check(spool)
        except UNREADABLE as error:
            raise damaged(spool, error) from error
        return found

    def _check(self, spool: Spool) -> None:
        """Refuse what `write` cannot have written."""
        spool.check_digest(self.inputs)
        texts = (self.source, self.scene, self.forms or "")
        if not all(isinstance(text, str) for text in texts):
            raise ObjectError("no text")
        if not all(isinstance(flag, bool) for flag in (self.keep, self.preview, self.sum_groups)):
            raise ObjectError("neither true nor false")
        try:
            _ = self.form
        except UsageError as error:
            raise ObjectError(str(error)) from error


def prepared_in(spool: Spool) -> PreparedBake:
    """Return the bake that was prepared in a spool. Raises BakeError if there is none, or it is damaged."""
    found = PreparedBake.read(spool)
    if found is None:
        raise BakeError(f"no bake is prepared in '{spool.path}': run `prepare SCENE --spool` first")
    return found


def damaged(spool: Spool, why: Exception | None = None) -> BakeError:
    """Return the error for a prepared bake that cannot be read."""
    said = "" if why is None else f" ({' '.join(str(why).split())[:200] or type(why).__name__})"
    return BakeError(f"the bake that was prepared in '{spool.path}' is damaged{said}: prepare it again")


def _settings(stored: Any) -> BakeSettings:
    """Return settings that were read. Raises ValueError, TypeError, UsageError if they are none."""
    settings = BakeSettings(**stored)
    check_settings(settings)
    return settings
