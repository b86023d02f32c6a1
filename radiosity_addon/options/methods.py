"""The methods of solving, and which settings each one has: for the front doors, without NumPy."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..base import UsageError

ASSEMBLIES = ("galerkin", "collocation", "linear")


@dataclass(frozen=True)
class Method:
    """One way to solve the radiosity equation.

    Parameters
    ----------
    label, description : str
        For people to choose by.
    settings : tuple of str
        Fields of `SolverSettings` that this method listens to, besides those that all do.
    """

    label: str
    description: str
    settings: tuple[str, ...]


METHODS = {
    "hierarchical": Method(
        "Hierarchical",
        "Links between elements of every size, refined where they may be wrong: the fastest at equal error",
        ("error", "min_area", "max_links", "tolerance", "max_iterations", "memory_limit"),
    ),
    "multi-level": Method(
        "Multi-Level",
        "Links between elements of every size, refined beforehand by their form factors",
        ("form_factor_error", "min_area", "max_links", "tolerance", "max_iterations", "memory_limit"),
    ),
    "two-level": Method(
        "Two-Level",
        "Large patches send, small elements inside them receive",
        ("elements", "patches", "contrast", "memory_limit"),
    ),
    "shooting": Method(
        "Shooting",
        "The brightest element sends its light, then the next: shows the scene as it brightens",
        ("elements", "ambient", "tolerance", "max_iterations", "memory_limit"),
    ),
    "conjugate-gradient": Method(
        "Conjugate Gradients",
        "A full matrix, solved by conjugate gradients on its symmetric form",
        ("elements", "assembly", "tolerance", "max_iterations", "memory_limit"),
    ),
    "gauss-seidel": Method(
        "Gauss-Seidel",
        "A full matrix, each element gathering the newest radiosities",
        ("elements", "assembly", "tolerance", "max_iterations", "memory_limit"),
    ),
    "jacobi": Method(
        "Jacobi",
        "A full matrix, all elements gathering at once: a bounce an iteration",
        ("elements", "assembly", "tolerance", "max_iterations", "memory_limit"),
    ),
    "dense": Method(
        "Dense",
        "A full matrix, solved directly: the truth for its elements",
        ("elements", "assembly", "memory_limit"),
    ),
}

SYMMETRIC_ONLY = frozenset({"conjugate-gradient"})
"""Methods that need a system which reciprocity makes symmetric: Galerkin's."""


@dataclass(frozen=True)
class MethodSetting:
    """A setting that only some methods have.

    Parameters
    ----------
    option : str
        Its name on the command line.
    metavar : str or None
        What stands for its value in the help; None where it takes none.
    label, description : str
        For people.
    kind : type
        int, float, bool or str.
    low, high : float
        Range of a number.
    above : bool
        `low` itself is not allowed.
    choices : tuple of str
        What a str may be.
    """

    option: str
    metavar: str | None
    label: str
    description: str
    kind: type
    low: float = 0.0
    high: float = 1.0
    above: bool = False
    choices: tuple[str, ...] = ()

    def check(self, value: Any) -> None:
        """Raise a `UsageError` unless the setting may have this value."""
        if self.choices and value not in self.choices:
            raise UsageError(f"{self.option} {value!r} is not one of {', '.join(self.choices)}")
        if self.kind not in (int, float):
            return
        # NaN compares as neither.
        if not self.low <= value <= self.high or (self.above and value == self.low):
            bounds = f"above {self.low:g} and at most" if self.above else f"between {self.low:g} and"
            raise UsageError(f"{self.option} {value} is not {bounds} {_plain(self.high)}")


MOST = 10_000_000
"""Elements, patches: what no machine has room for need not be tried."""

SETTINGS = {
    "elements": MethodSetting(
        "--elements",
        "N",
        "Elements",
        "About how many elements the surfaces are divided into",
        int,
        1,
        MOST,
    ),
    "assembly": MethodSetting(
        "--assembly",
        None,
        "Assembly",
        "How the matrix is made: area means, values at centroids, or values at vertices",
        str,
        choices=ASSEMBLIES,
    ),
    "patches": MethodSetting(
        "--patches",
        "N",
        "Patches",
        "About how many patches the elements are grouped into",
        int,
        1,
        MOST,
    ),
    "contrast": MethodSetting(
        "--contrast",
        "C",
        "Contrast",
        "Neighbouring elements are split where their light differs by more than this part of the mean",
        float,
        0.0,
        1000.0,
        above=True,
    ),
    "form_factor_error": MethodSetting(
        "--form-factor-error",
        "F",
        "Form Factor Error",
        "F_ε: a link is refined while its form factor may exceed this",
        float,
    ),
    "error": MethodSetting(
        "--link-error",
        "E",
        "Link Error",
        "BF_ε: a link is refined while it may misplace more than this part of the light's power",
        float,
        above=True,
    ),
    "min_area": MethodSetting(
        "--min-area",
        "A",
        "Smallest Area",
        "A_ε: no element becomes smaller than this part of the scene's lit area",
        float,
        above=True,
    ),
    "max_links": MethodSetting(
        "--max-links",
        "N",
        "Most Links",
        "Refinement stops at so many links",
        int,
        1,
        1_000_000_000,
    ),
    "ambient": MethodSetting(
        "--ambient",
        None,
        "Ambient Term",
        "Show the light that is not sent yet as an even, ambient light; the result does not change",
        bool,
    ),
    "tolerance": MethodSetting(
        "--tolerance",
        "T",
        "Tolerance",
        "Residual at which the iteration stops, as a part of the light's power",
        float,
        above=True,
    ),
    "max_iterations": MethodSetting(
        "--max-iterations",
        "N",
        "Most Iterations",
        "Iterations, or shots, after which it stops anyway",
        int,
        1,
        1_000_000_000,
    ),
    "memory_limit": MethodSetting(
        "--memory-limit",
        "GIB",
        "Memory Limit",
        "Memory that the system may take, in GiB; what would need more is refused",
        float,
        0.0,
        1e6,
        above=True,
    ),
}
"""Every method setting by the field of `SolverSettings` that it is."""


def check_method(method: str, given: Mapping[str, Any]) -> None:
    """Check a method and the settings given to it.

    Parameters
    ----------
    method : str
    given : mapping
        Values by name, only of what was given.

    Raises
    ------
    UsageError
        If there is no such method, if a setting does not apply to it, or a value is out of
        its range.
    """
    if method not in METHODS:
        raise UsageError(f"method {method!r} is not one of {', '.join(METHODS)}")
    applies = METHODS[method].settings
    options = ", ".join(SETTINGS[name].option for name in applies)
    for name, value in given.items():
        if name not in applies:
            raise UsageError(
                f"{SETTINGS[name].option} does not apply to --method {method}; it takes {options}"
            )
        SETTINGS[name].check(value)
    if method in SYMMETRIC_ONLY and given.get("assembly", "galerkin") != "galerkin":
        raise UsageError(
            f"--method {method} needs the symmetric system of --assembly galerkin; "
            f"take --method gauss-seidel with --assembly {given['assembly']}"
        )
    if given.get("patches", 0) > given.get("elements", math.inf):
        raise UsageError(
            f"--patches {given['patches']} is more than --elements {given['elements']}: "
            "patches consist of elements"
        )


def _plain(number: float) -> str:
    """A bound as people write it."""
    return f"{number:,.0f}" if number >= 1000 else f"{number:g}"
