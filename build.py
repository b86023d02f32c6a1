#!/usr/bin/env python3
"""One front door for everything a developer does: `python3 build.py VERB ...`, standard library only.

It sets itself up: the first verb that needs packages makes `.venv` next to this file with the
pinned versions of `requirements/`, later ones only check that the pins have not changed.
"""

import os
import sys
from collections.abc import Callable
from functools import partial

SUPPORTED_PYTHONS = ((3, 11), (3, 13))

if sys.version_info[:2] not in SUPPORTED_PYTHONS:
    # Not an f-string, so that the oldest Pythons get the message too.
    sys.exit(
        "build.py: error: Blender's Python module exists for Python 3.11 and 3.13 only, this is %d.%d; "  # noqa: UP031
        "run `python3.11 build.py ...` or `python3.13 build.py ...` (Debian 12: apt-get install -y "
        "python3.11 python3.11-venv, Debian 13: apt-get install -y python3.13 python3.13-venv)"
        % sys.version_info[:2]
    )

from pathlib import Path  # noqa: E402  (after the check, so that an old Python gets the message)

from build_tools import environments  # noqa: E402
from build_tools.errors import BuildError  # noqa: E402

ROOT = Path(__file__).resolve().parent

SIDE_BY_SIDE = ("-n", "auto", "--maxprocesses", "8", "--dist", "loadfile")
"""How pytest spreads tests over the cores: those of one file share what they prepare."""

WITHOUT_BLENDER = ("tests/unit", "tests/analytic")
"""Folders of tests that need neither bpy nor a window."""

LINT_IMPORTS = "from importlinter.cli import lint_imports_command; lint_imports_command()"
"""import-linter has no module to run. Its contracts are in pyproject.toml."""

ADD_ON_VERBS = ("bake", "prepare", "finish", "flip", "export", "restore")
"""Verbs of the add-on's own command line."""

USAGE = """\
usage: python3 build.py VERB [arguments]

  bake [SCENE] [options]     bake a scene, or the bundled Cornell box (bake --help lists the options)
  prepare [SCENE] --spool DIR, finish [SCENE] --spool DIR --output DIR
                             the first and the last stage of a bake that is run without Blender in between
  flip SCENE --output FILE   flip faces that show their backs and would be black
  restore SCENE --output FILE  take a bake out of a .blend again
  export DIR [options]       export a bake for browsers and engines
  test [WHICH] ...           run all tests but slow ones that repeat others; what follows goes to pytest
                             --quick: the fast ones that need neither bpy nor a window, in an environment
                             without bpy, of the newest Python that is here; --full: the others, too;
                             --bpy 4.2 or 5.2: with that bpy, in an environment of its own
  fuzz [--seeds A:B]         bake random scenes and check what must hold of each (default 0:500)
  bench [--case NAME] ...    measure against Cycles into bench/results and the README; --small tries
                             all of it out in a minute
  check                      lint, layer rule and types
  figures [--check] [NAME…]  compute the figures of docs/theory, or only assert their numbers
          [gallery [ROW…]]   and the pictures of docs/gallery.md, minutes of work; --check bakes none
  options                    write docs/options.md from the table of options
  docs                       build docs/ to a static site in out/site
  viewer                     bundle the web viewer with three.js into the extension (needs Node.js)
  package                    make the extension's zips in dist/, one a platform
  real-blender               install the Blender that the tests with a window use (root on Debian)
"""


def main(arguments: list[str]) -> int:
    """Run the verb that `arguments` starts with; returns the exit code."""
    if not arguments or arguments[0] in ("-h", "--help", "help"):
        print(USAGE, end="")
        return 0 if arguments else 2
    verb, rest = arguments[0], arguments[1:]
    verbs: dict[str, Callable[[list[str]], int]] = {
        **{name: partial(run_add_on, name) for name in ADD_ON_VERBS},
        "test": test,
        "fuzz": fuzz,
        "bench": bench,
        "check": check,
        "figures": figures,
        "options": options,
        "docs": docs,
        "package": package,
        "viewer": viewer,
        "real-blender": prepare_real_blender,
    }
    if verb not in verbs:
        print(f"build.py: error: no verb {verb!r}; there are {', '.join(verbs)}", file=sys.stderr)
        return 2
    try:
        if rest and verb in ("options", "docs", "package", "real-blender"):
            raise BuildError(f"{verb} takes no arguments, got {rest[0]!r}")
        return verbs[verb](rest)
    except BuildError as error:
        print(f"build.py: error: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


def run_add_on(verb: str, arguments: list[str]) -> int:
    """Hand over to the command line of the add-on, which says where everything is."""
    return environments.main_environment(ROOT).hand_over("-m", "radiosity_addon", verb, *arguments)


def test(arguments: list[str]) -> int:
    """Run pytest with what follows; without that, all tests that `--quick`, `--full` or `--bpy` ask for."""
    which = arguments[0] if arguments and arguments[0] in ("--quick", "--full", "--bpy") else ""
    rest = arguments[1:] if which else arguments
    folders: tuple[str, ...] = ()
    if which == "--quick":
        environment, folders = environments.quick_environment(ROOT), WITHOUT_BLENDER
    elif which == "--bpy":
        if not rest:
            print("build.py: error: --bpy needs a version, such as 4.2", file=sys.stderr)
            return 2
        environment, rest = environments.bpy_environment(ROOT, rest[0]), rest[1:]
    else:
        environment = environments.main_environment(ROOT)
    os.chdir(ROOT)
    if rest:
        return environment.hand_over("-m", "pytest", *rest)
    left_out = {"--full": "real_blender", "--quick": "full or slow"}.get(which, "real_blender or full")
    code = environment.run("-m", "pytest", *SIDE_BY_SIDE, "-m", f"not ({left_out})", *folders)
    if which in ("--quick", "--bpy"):
        return code
    # Windows share one real Blender, of Debian's own version.
    code = environment.run("-m", "pytest", *SIDE_BY_SIDE, "-m", "real_blender and not timed") or code
    return environment.run("-m", "pytest", "-m", "timed") or code


def fuzz(arguments: list[str]) -> int:
    """Bake random scenes; more of them than the tests do, if so asked."""
    os.chdir(ROOT)
    return environments.main_environment(ROOT).hand_over("-m", "tests.fuzz", *arguments)


def bench(arguments: list[str]) -> int:
    """Measure speed and accuracy, against Cycles' bake and with growing scenes."""
    return environments.bench_environment(ROOT).hand_over("-m", "bench", *arguments)


def check(arguments: list[str]) -> int:
    """Lint, layers and types; all are run even if one fails."""
    environment = environments.main_environment(ROOT)
    os.chdir(ROOT)
    failures = [
        name
        for name, command in (
            ("ruff", ("-m", "ruff", "check", *arguments, ".")),
            ("import-linter", ("-c", LINT_IMPORTS, "--no-cache")),
            ("mypy", ("-m", "mypy")),
        )
        if environment.run(*command) != 0
    ]
    print(f"check: {', '.join(failures)} failed" if failures else "check: passed")
    return 1 if failures else 0


def figures(arguments: list[str]) -> int:
    """Compute, check and draw the figures of the theory pages, then the gallery's, or one of the two."""
    os.chdir(ROOT)
    only_gallery, code = arguments[:1] == ["gallery"], 0
    if not only_gallery:
        code = environments.docs_environment(ROOT).run(str(ROOT / "docs" / "figures"), *arguments)
    if only_gallery or not set(arguments) - {"--check"}:
        rows = arguments[1:] if only_gallery else arguments
        code = environments.main_environment(ROOT).run("-m", "tests.golden.gallery", *rows) or code
    return code


def options(_: list[str]) -> int:
    """Write the documentation's page of options."""
    os.chdir(ROOT)
    return environments.main_environment(ROOT).hand_over("-m", "build_tools.options_page")


def docs(_: list[str]) -> int:
    """Build the documentation's site; a broken link fails."""
    os.chdir(ROOT)
    code = environments.docs_environment(ROOT).run("-m", "mkdocs", "build", "--strict")
    if code == 0:
        print(f"the site is in {ROOT / 'out' / 'site'}; open index.html")
    return code


def viewer(_: list[str]) -> int:
    """Bundle the web viewer into the extension."""
    from build_tools import viewer_bundle

    viewer_bundle.write_viewer(ROOT)
    return 0


def package(_: list[str]) -> int:
    """Make the extension's zips and say where they are."""
    from build_tools import extension

    for path in extension.build(ROOT, environments.main_environment(ROOT), ROOT / "dist"):
        print(f"{path.relative_to(ROOT)}  {path.stat().st_size / 1e6:.1f} MB")
    return 0


def prepare_real_blender(_: list[str]) -> int:
    """Install the Blender that the tests need in addition to the module, if it is not there yet."""
    from build_tools import real_blender

    print(f"Blender is in {real_blender.prepare().root}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
