"""Hostile use of the program, from outside: it is driven by its operators and its command line alone.

Nothing here shares code with the program's own checks nor with `tests/fuzz`. See docs/reliability.md.
"""
