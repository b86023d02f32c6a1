"""Write `docs/options.md` from the table of options: `python3 build.py options`."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from radiosity_addon.bake.quality import QUALITY_SETTINGS, quality_of
from radiosity_addon.cli.command_options import BAKE_COMMAND, EVERY_COMMAND, EVERY_EXPORT, EXPORT_COMMAND
from radiosity_addon.options import (
    MAIN,
    METHODS,
    OPTIONS,
    PANEL_OPTIONS,
    SECTIONS,
    BakeSettings,
    Option,
    options_of_method,
    plain,
)

PAGE = Path(__file__).resolve().parents[1] / "docs" / "options.md"

ALL = (*PANEL_OPTIONS.values(), *OPTIONS.values())

INTRODUCTION = """\
# Options

All options of a bake, for the command line, the panel and scripts. The
[user guide](user-guide.md#settings-what-to-choose) says what to choose. `python3 build.py options` writes
this page from the tables in `radiosity_addon/options/`.

Scripts set the fields of `radiosity_addon.options.BakeSettings`. They have the names of the options, with
underscores, except: {exceptions}."""

METHODS_TEXT = """\
A setting that the method does not have is a usage error. What is not given comes from the quality; in the
panel, such a number shows *set by quality* until a value is entered."""


def page() -> str:
    """Return the page as the table of options makes it."""
    commands = [
        *BAKE_COMMAND.values(),
        *EXPORT_COMMAND.values(),
        *EVERY_EXPORT.values(),
        *EVERY_COMMAND.values(),
    ]
    rows = ((_flag(option), _meaning(option)) for option in commands)
    parts = [_introduction(), "## Command", _table(("option", "meaning"), rows)]
    for section, part in SECTIONS.items():
        parts.append(f"## {section}")
        if part not in (MAIN, section):
            parts.append(f"In the panel under *{part}*.")
        options = [option for option in ALL if option.section == section]
        parts.append(_general([option for option in options if not option.methods]))
        of_methods = [option for option in options if option.methods]
        if of_methods:
            parts += [METHODS_TEXT, _methods(), _of_methods(of_methods)]
    return "\n\n".join([*parts, *_presets()]) + "\n"


def write() -> None:
    """Write the page where the documentation has it."""
    PAGE.write_text(page(), encoding="utf-8")
    print(f"written: {PAGE}")


def _introduction() -> str:
    exceptions = [
        f"`{name}` (`{option.flag}`)"
        for name, option in OPTIONS.items()
        if option.flag != "--" + name.replace("_", "-")
    ]
    return INTRODUCTION.format(exceptions=", ".join(exceptions))


def _general(options: list[Option]) -> str:
    rows = ((_flag(option), _label(option), _meaning(option), _default(option)) for option in options)
    return _table(("option", "in the panel", "meaning", "default"), rows)


def _of_methods(options: list[Option]) -> str:
    rows = ((_flag(option), _label(option), _meaning(option), _by_quality(option)) for option in options)
    return _table(("option", "in the panel", "meaning", ", ".join(QUALITY_SETTINGS)), rows)


def _methods() -> str:
    rows = (
        (f"`{name}`", method.description, " ".join(f"`{OPTIONS[of].flag}`" for of in options_of_method(name)))
        for name, method in METHODS.items()
    )
    return _table(("`--method`", "what it does", "its settings"), rows)


def _presets() -> tuple[str, ...]:
    labels = [_label(option) for option in ALL if option.preset]
    text = "A preset sets these options and nothing else:"
    return "## Presets", f"{text} {', '.join(labels)}."


def _table(titles: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    return "\n".join(
        [
            f"| {' | '.join(titles)} |",
            f"|{'---|' * len(titles)}",
            *(f"| {' | '.join(row)} |" for row in rows),
        ]
    )


def _flag(option: Option) -> str:
    """Return an option as it is typed; a dash for what only the panel has."""
    if PANEL_OPTIONS.get(option.name) is option:
        return "–"
    if option.choices:
        return f"`{option.flag}`"
    more = "…" if option.kind is tuple and not option.repeated else ""
    return f"`{option.flag} {option.metavar}{more}`".replace(" `", "`")


def _label(option: Option) -> str:
    return "–" if option.panel is None else f"*{option.panel.label}*"


def _meaning(option: Option) -> str:
    """Return what an option does, with its range or choices, and what it cannot be given with."""
    sentences = [f"{option.description}. The flag turns it off" if option.off else option.description]
    if option.range:
        sentences.append(option.range[0].upper() + option.range[1:])
    if option.instead_of:
        flag = {**OPTIONS, **BAKE_COMMAND}[option.instead_of].flag
        sentences.append(f"Not together with `{flag}`")
    # Methods have a table of their own.
    choices = () if option.name == "method" else option.choices
    return "<br>".join([". ".join(sentences), *(f"`{each.value}`: {each.description}" for each in choices)])


def _default(option: Option) -> str:
    if option.kind is bool:
        return "on" if option.default else "off"
    if option.default in (None, ()):
        return "–"
    return plain(option.default) if option.kind in (int, float) else f"`{option.default}`"


def _by_quality(option: Option) -> str:
    """Return what the qualities give a setting, and methods for which that is something else."""
    values: dict[str, list[str]] = {}
    for method in option.methods:
        settings = (BakeSettings(quality=quality, method=method) for quality in QUALITY_SETTINGS)
        given = [_value(getattr(quality_of(each).solver, option.name)) for each in settings]
        text = given[0] if len(set(given)) == 1 else ", ".join(given)
        values.setdefault(text, []).append(method)
    common, *others = sorted(values, key=lambda text: -len(values[text]))
    notes = [f"`{method}`: {text}" for text in others for method in values[text]]
    return f"{common} ({'; '.join(notes)})" if notes else common


def _value(value: object) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, int):
        return f"{value:,}"
    return f"{value:g}" if isinstance(value, float) else f"`{value}`"


if __name__ == "__main__":
    write()
