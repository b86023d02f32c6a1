"""Of many warnings alike, one is shown; what is said once is never lost among them."""

from __future__ import annotations

from radiosity_addon.base.similar_warnings import one_of_each
from radiosity_addon.cli.console import summary


def warning(name: str, message: str) -> dict[str, str]:
    return {"name": name, "message": message}


def missing(number: int) -> dict[str, str]:
    message = (
        f"material 'slot{number}': Base Color comes from image 'wall_{number}.jpg', which has no pixels; "
        f"(0.{number}, 0.8, 0.8) is used"
    )
    return warning(f"slot{number}", message)


TOO_SMALL = warning("map", "map: 256 px is too small to keep 10713 charts apart")


def test_few_alike_stay_as_they_are() -> None:
    warnings = [missing(1), TOO_SMALL, missing(2), missing(3)]
    assert one_of_each(warnings) == [missing(1), missing(2), missing(3), TOO_SMALL]


def test_many_alike_become_one_that_stands_for_the_others() -> None:
    shown = one_of_each([*map(missing, range(84)), TOO_SMALL])
    assert shown[1:] == [TOO_SMALL]
    assert shown[0]["name"] == "slot0"
    assert shown[0]["message"].startswith(missing(0)["message"])
    assert shown[0]["message"].endswith("(83 more like this in the report, of slot1, slot2, slot3 …)")


def test_others_of_the_same_thing_are_not_named_again() -> None:
    shown = one_of_each([warning("box", f"object 'box': triangle {number} is odd") for number in range(4)])
    assert [entry["message"] for entry in shown] == [
        "object 'box': triangle 0 is odd (3 more like this in the report)"
    ]


def test_what_differs_in_words_is_another_kind() -> None:
    warnings = [warning("box", f"object 'box' is {word}") for word in ("red", "green", "blue", "odd")]
    assert one_of_each(warnings) == warnings


def test_the_console_counts_all_and_lists_one_of_each() -> None:
    report = {
        "objects": [{}],
        "solver": {"method": "hierarchical", "elements": 1, "links": 1, "rays": 1},
        "seconds": {},
        "warnings": [*map(missing, range(84)), TOO_SMALL],
    }
    lines = summary("out", [], report)
    start = next(row for row, line in enumerate(lines) if line.startswith("85 warnings, "))
    assert len(lines[start + 1 :]) == 2
    assert lines[-1] == f"  map: {TOO_SMALL['message']}"
