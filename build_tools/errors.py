"""The one error that ends a build verb with a message instead of a traceback."""


class BuildError(Exception):
    """Something the reader has to fix; the message is one line that says how."""
