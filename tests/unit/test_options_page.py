"""The documentation's page of options is what the table makes it."""

from __future__ import annotations

from build_tools.options_page import PAGE, page


def test_the_page_is_up_to_date() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(), "run python3 build.py options"
