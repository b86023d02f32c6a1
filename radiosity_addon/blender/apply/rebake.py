"""An earlier bake while a new one is made: hidden for a moment, then replaced, or put back on failure.

A bake must read the user's own meshes and materials, yet the old lightmaps stay until the new ones are there.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager

import bpy

from ...base import BakeWarning
from ..datablocks.bake_record import ASIDE, made_datablocks, remove_datablocks
from ..stand_ins.stand_ins import INSTANCER, own_mesh, source_name
from .edits import carry_edits
from .shown_state import ShownState, showing, take_off
from .sweep import sweep


@contextmanager
def originals_shown(context: bpy.types.Context) -> Iterator[tuple[BakeWarning, ...]]:
    """Show what is the user's for a moment, as if nothing had been baked; yields what to warn of.

    Edits made since the bake are part of it.
    """
    warnings = carry_edits(context)
    with bare(context):
        yield warnings


class Originals:
    """Shows what is the user's, moment by moment, as `originals_shown`.

    Edits made before the first moment are part of all. Later ones stay where they were made until lightmaps
    are applied, which carries them.

    warnings: What to warn of, once the first moment came.
    """

    def __init__(self, context: bpy.types.Context) -> None:
        self._context = context
        self._carried = False
        self.warnings: tuple[BakeWarning, ...] = ()

    def __call__(self) -> AbstractContextManager[None]:
        """Return what shows them while it is entered; within, the scene is not evaluated yet."""
        if not self._carried:
            self.warnings, self._carried = carry_edits(self._context), True
        return bare(self._context, evaluated=False)


@contextmanager
def bare(context: bpy.types.Context, evaluated: bool = True) -> Iterator[None]:
    """Take all lightmaps of the file off for a moment, for which the scene may be evaluated as well."""
    objects = showing()
    state = ShownState(objects)
    stand_ins = [
        (block, block.hide_viewport, block.hide_render)
        for block in made_datablocks()
        if isinstance(block, bpy.types.Object)
    ]
    try:
        take_off(objects)
        for block, _, _ in stand_ins:
            block.hide_viewport = block.hide_render = True
        if evaluated:
            context.view_layer.update()
        yield
    finally:
        state.put_back()
        for block, hide_viewport, hide_render in stand_ins:
            block.hide_viewport, block.hide_render = hide_viewport, hide_render
        context.view_layer.update()


class EarlierBake:
    """What a new bake replaces, once it takes it off.

    While a new bake is made, the datablocks of earlier ones have names that leave theirs free.

    keep collection of str: Names of objects that keep what they show.
    is_partial: Instances that are not baked keep what they show too, where others of the same instancer are.
    warnings: What to warn of: edits made while the new bake was computed.
    """

    def __init__(
        self, context: bpy.types.Context, keep: Collection[str] = (), is_partial: bool = False
    ) -> None:
        self.warnings = carry_edits(context)
        self._context = context
        self.keep = frozenset(keep)
        self.is_partial = is_partial
        self._state: ShownState | None = None
        self._made = [(block, block.name.removeprefix(ASIDE)) for block in made_datablocks()]
        self._stays: set[bpy.types.Object] = set()
        for block, name in self._made:
            block.name = f"{ASIDE}{name}"

    @property
    def stand_ins(self) -> dict[str, bpy.types.Object]:
        """The stand-in objects of earlier bakes, by name."""
        return {name: block for block, name in self._made if isinstance(block, bpy.types.Object)}

    @property
    def kept_sources(self) -> frozenset[str]:
        """Names of what keeps its lightmap, as a report knows them."""
        stay = [block for block in self.stand_ins.values() if not self._goes(block)]
        return self.keep | {source_name(block) for block in stay}

    def let_stay(self, stand_in: bpy.types.Object) -> None:
        """Keep a stand-in though the object that makes its instance is shown again."""
        self._stays.add(stand_in)

    def take_off(self, targets: Sequence[bpy.types.Object]) -> None:
        """Take lightmaps off all objects but those to keep; `targets` are about to be changed, too."""
        going = [obj for obj in showing() if obj.name not in self.keep]
        meshes = {own_mesh(obj) for obj in targets}
        sharing = [obj for obj in showing() if own_mesh(obj) in meshes]
        self._state = ShownState(list(dict.fromkeys([*going, *targets, *sharing])))
        take_off(going)

    def show_again(self) -> None:
        """Show the earlier bake again, exactly as it was."""
        if self._state is not None:
            self._state.put_back()
            self._context.view_layer.update()

    def put_back(self) -> None:
        """Show the earlier bake again, and remove what was made since."""
        self.show_again()
        before = {block for block, _ in self._made}
        remove_datablocks([block for block in made_datablocks() if block not in before])
        self._name_back()
        self._context.view_layer.update()

    def discard(self) -> None:
        """Remove what nothing shows any more."""
        sweep([block for block in self.stand_ins.values() if self._goes(block)])
        self._made = [(block, name) for block, name in self._made if _is_there(block)]
        self._name_back()
        self._context.view_layer.update()

    def _goes(self, stand_in: bpy.types.Object) -> bool:
        instancer = stand_in.get(INSTANCER)
        kept = instancer is not None and instancer.name in self.keep
        return not kept and stand_in not in self._stays

    def _name_back(self) -> None:
        for block, name in self._made:
            if block.name.startswith(ASIDE):
                block.name = name


def _is_there(block: bpy.types.ID) -> bool:
    """Whether a datablock has not been removed."""
    try:
        return bool(block.name)
    except ReferenceError:
        return False


@contextmanager
def replacing_earlier(
    context: bpy.types.Context, keep: Collection[str] = (), is_partial: bool = False
) -> Iterator[EarlierBake]:
    """Replace the earlier bake by what `apply_lightmaps` shows in this block, except for objects to `keep`.

    A failure in it leaves what was there before.
    """
    earlier = EarlierBake(context, keep, is_partial)
    try:
        yield earlier
    except BaseException:
        earlier.put_back()
        raise
    earlier.discard()
