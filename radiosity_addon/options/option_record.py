"""An option of a bake, and everything that the front doors show of it.

A field of `BakeSettings` is declared by `option(...)`: its name, type and default are the field's, the rest
is kept with the field. The parser, the panel's properties and rows, the presets, the checks of values and the
page `docs/options.md` are made from these records.
"""

from __future__ import annotations

import types
from dataclasses import field, fields
from typing import Any, NamedTuple, get_args, get_origin, get_type_hints

from ..base import UsageError

UNBOUNDED = float("inf")

_METAVARS: dict[type, str] = {int: "N", float: "X"}


class Choice(NamedTuple):
    """One of the values that an option may have.

    number: By which Blender's files know it; None for its place among those that have none.
    """

    value: str
    label: str
    description: str
    number: int | None = None


class PanelRow(NamedTuple):
    """An option's property and its row in the panel.

    Parameters
    ----------
    label : str
    identifier : str
        Name of the property, where it is not that of the option.
    default : number or None
        What the property shows first, where the option's own default is None. Without it a number is
        *automatic*: 0 stands for None.
    low : number or None
        The least that can be typed, where it is not that of the option.
    soft_low, soft_high : number or None
        Range of the slider.
    subtype : str
        Blender's word for the unit.
    precision, step : number
        Digits shown, and hundredths that a click on the arrow adds.
    only_if : pairs of (property, value)
        The row is shown, and the option taken from the panel, only where all of these hold.
    expand : bool
        Choices are buttons side by side instead of a menu.
    group : str
        The scene's group of properties that holds it.
    other_choice : Choice or None
        A last choice in the menu, for which the option keeps its default.
    """

    label: str
    identifier: str = ""
    default: float | None = None
    low: float | None = None
    soft_low: float | None = None
    soft_high: float | None = None
    subtype: str = "NONE"
    precision: int = 3
    step: float = 3
    only_if: tuple[tuple[str, str], ...] = ()
    expand: bool = False
    group: str = "radiosity"
    other_choice: Choice | None = None


class Option(NamedTuple):
    """An option of a bake or of a command.

    Parameters
    ----------
    description : str
        One sentence without its period: tooltip, help and entry of the options' page.
    section : str
        A key of `SECTIONS`.
    name : str
        Field of `BakeSettings`, and attribute of the parsed command line.
    kind : type
        int, float, bool, str, tuple (of names), or Path.
    default
    flag : str
        Its name on the command line; `--name` if it is not given.
    metavar : str
        What stands for its value in the help; N for whole numbers and X for others if it is not given.
    limits : (float, float)
        Least and largest value of a number; the least must be finite.
    above : bool
        The least value itself is not allowed.
    unit : str
    choices : tuple of Choice
    instead_of : str
        Name of the option that this one replaces: the command line takes only one of the two.
    repeated : bool
        The command line may give it several times.
    methods : tuple of str
        The methods that have this option; empty if it has nothing to do with the method.
    preset : bool
        Whether presets set it.
    panel : PanelRow or None
        None for what only the command line and scripts have.
    off : str
        What the flag of an option does that is on by default: it turns it off.
    """

    description: str
    section: str
    name: str = ""
    kind: type = bool
    default: Any = None
    flag: str = ""
    metavar: str = ""
    limits: tuple[float, float] = (-UNBOUNDED, UNBOUNDED)
    above: bool = False
    unit: str = ""
    choices: tuple[Choice, ...] = ()
    instead_of: str = ""
    repeated: bool = False
    methods: tuple[str, ...] = ()
    preset: bool = False
    panel: PanelRow | None = None
    off: str = ""

    @property
    def values(self) -> tuple[str, ...]:
        """The values of the choices."""
        return tuple(choice.value for choice in self.choices)

    @property
    def identifier(self) -> str:
        """Name of the property in the panel."""
        return (self.panel and self.panel.identifier) or self.name

    @property
    def automatic(self) -> bool:
        """Whether 0 in the panel stands for None."""
        number = self.kind in (int, float) and self.default is None
        return number and self.panel is not None and self.panel.default is None

    @property
    def range(self) -> str:
        """The range of a number as a message has it; empty for other kinds."""
        if self.kind not in (int, float):
            return ""
        low, high = map(plain, self.limits)
        if self.limits[1] == UNBOUNDED:
            bounds = f"at least {low}"
        else:
            bounds = f"above {low} and at most {high}" if self.above else f"between {low} and {high}"
        return f"{bounds} {self.unit}".strip()

    def check(self, value: Any) -> None:
        """Raise a `UsageError` unless the option may have this value."""
        if value is None and self.default is None:
            return
        if self.choices and value not in self.values:
            raise UsageError(f"{self.flag} {value!r} is not one of {', '.join(self.values)}")
        if self.kind not in (int, float):
            return
        # NaN compares as neither.
        low, high = self.limits
        if not low <= value <= high or (self.above and value == low):
            raise UsageError(f"{self.flag} {value} is not {self.range}")


def option(default: Any, description: str, section: str, **more: Any) -> Any:
    """Return a dataclass field with this default that carries an `Option`."""
    return field(default=default, metadata={"option": Option(description, section, default=default, **more)})


def options_of(record: type) -> dict[str, Option]:
    """Return the options that a dataclass declares, by name, with what name and type of the field say."""
    hints = get_type_hints(record)
    return {
        entry.name: _named(entry.metadata["option"], entry.name, _kind(hints[entry.name]))
        for entry in fields(record)
    }


def plain(number: float) -> str:
    """Return a bound as people write it."""
    return f"{number:,.0f}" if number >= 100_000 else f"{number:g}"


def _named(found: Option, name: str, kind: type) -> Option:
    """Return an option with its name and kind, and with the flag and metavar that follow from them."""
    flag = found.flag or "--" + name.replace("_", "-")
    metavar = found.metavar or _METAVARS.get(kind, "")
    return found._replace(name=name, kind=kind, flag=flag, metavar=metavar)


def _kind(hint: Any) -> type:
    """Return the type of what is not None."""
    if get_origin(hint) is types.UnionType:
        return _kind(next(part for part in get_args(hint) if part is not type(None)))
    kind: type = get_origin(hint) or hint
    return kind
