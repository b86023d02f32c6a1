"""build.py on machines that lack something, and the environments it makes."""

from __future__ import annotations

import importlib
import subprocess
import sys
from pathlib import Path

import pytest

from build_tools import environments, system
from build_tools.environments import Environment
from build_tools.errors import BuildError
from tests.wording import says

ROOT = Path(__file__).resolve().parents[2]


def run(*command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *command], cwd=ROOT, capture_output=True, text=True, check=False, timeout=300
    )


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A checkout whose pins are empty, so that its environments need no network."""
    pins = tmp_path / "requirements"
    pins.mkdir()
    for name in ("bpy-4.2", "bpy-5.0", "bpy-5.2", "dask", "docs", "quick", "tools"):
        (pins / f"{name}.txt").write_text("# nothing\n")
    return tmp_path


@pytest.mark.parametrize("version", [(2, 7), (3, 10), (3, 12), (3, 14)])
def test_an_unsupported_python_is_told_what_to_do(version: tuple[int, int]) -> None:
    pretend = f"import sys, runpy; sys.version_info = {(*version, 1, 'final', 0)}; "
    start = "sys.argv = ['build.py', 'bake']; runpy.run_path('build.py', run_name='__main__')"
    done = run("-c", pretend + start)
    assert done.returncode == 1
    assert done.stdout == ""
    message = done.stderr.splitlines()
    assert len(message) == 1
    assert "this is {}.{};".format(*version) in message[0]
    assert "`python3.11 build.py" in message[0]
    assert "apt-get install" in message[0]


def test_all_that_is_missing_is_named_with_its_packages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    python = tmp_path / "python3.11"
    python.write_text("#!/bin/sh\nexit 1\n")
    python.chmod(0o755)
    monkeypatch.setattr(sys, "platform", "linux")
    libraries = {"libnowhere.so.6": "libnowhere6", "libc.so.6": "libc6", "libgone.so.1": "libgone1"}
    monkeypatch.setattr(system, "DEBIAN_PACKAGE_OF_LIBRARY", libraries)
    with pytest.raises(BuildError) as missing:
        system.require(str(python), (3, 11))
    assert says(str(missing.value), "libnowhere.so.6", "libgone.so.1", f"venv module of {python}")
    assert str(missing.value).endswith(" install -y libnowhere6 libgone1 python3.11-venv")


def test_an_environment_that_is_there_needs_no_venv_module(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(system, "DEBIAN_PACKAGE_OF_LIBRARY", {"libc.so.6": "libc6"})
    system.require(None, (3, 11))


def test_the_documentation_needs_no_library_of_blenders(
    checkout: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(system, "DEBIAN_PACKAGE_OF_LIBRARY", {"libnowhere.so.6": "libnowhere6"})
    made = environments.docs_environment(checkout)
    assert made.folder == checkout / ".envs" / "docs"
    assert made.run("-c", "import pip") == 0


def test_a_missing_python_is_named() -> None:
    with pytest.raises(BuildError, match=r"python3\.99"):
        system.find_python((3, 99))


def test_an_environment_is_made_once(checkout: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = environments.main_environment(checkout)
    assert made.run("-c", "import pip") == 0
    monkeypatch.setattr(environments, "create", _must_not_be_called)
    monkeypatch.setattr(environments, "install", _must_not_be_called)
    assert environments.main_environment(checkout) == made


def test_what_only_the_benchmarks_need_lies_next_to_the_main_environment(
    checkout: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (checkout / "requirements" / "bench.txt").write_text("# nothing\n")
    asked: list[tuple[str, ...]] = []

    def install(folder: Path, pins: list[Path], *how: str) -> None:
        if how:
            (checkout / ".envs" / "bench").mkdir(parents=True, exist_ok=True)
            (checkout / ".envs" / "bench" / "only_here.py").write_text("raise SystemExit(3)")
            asked.append(how)

    monkeypatch.setattr(environments, "install", install)
    made = environments.bench_environment(checkout)
    assert made.folder == environments.main_environment(checkout).folder
    assert made.run("-c", "import only_here") == 3
    environments.bench_environment(checkout)
    assert asked == [("--no-deps", "--target", str(checkout / ".envs" / "bench"))]


def test_changed_pins_and_interrupted_installations_are_brought_up_to_date_in_place(
    checkout: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = environments.main_environment(checkout)
    monkeypatch.setattr(environments, "create", _must_not_be_called)
    installed: list[Path] = []
    monkeypatch.setattr(environments, "install", lambda folder, _pins: installed.append(folder))

    (checkout / "requirements" / "tools.txt").write_text("# something else\n")
    environments.main_environment(checkout)
    assert installed == [made.folder]

    (made.folder / "pins.sha256").unlink()
    environments.main_environment(checkout)
    environments.main_environment(checkout)
    assert installed == [made.folder, made.folder]


def test_a_half_made_environment_is_made_again(checkout: Path) -> None:
    folder = checkout / ".venv"
    (folder / "bin").mkdir(parents=True)
    (folder / "bin" / "python").write_text("")
    (folder / "pyvenv.cfg").write_text("home = /nowhere\n")
    assert environments.main_environment(checkout).run("-c", "import pip") == 0


def test_pip_that_fails_is_an_error_and_leaves_no_stamp(checkout: Path) -> None:
    (checkout / "requirements" / "tools.txt").write_text("--no-index\nthere-is-no-such-package==1\n")
    with pytest.raises(BuildError, match="pip"):
        environments.main_environment(checkout)
    assert not (checkout / ".venv" / "pins.sha256").exists()


def test_a_version_without_pins_is_an_error(checkout: Path) -> None:
    with pytest.raises(BuildError, match=r"3\.6.*4\.2"):
        environments.bpy_environment(checkout, "3.6")


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (("-c", "raise SystemExit(7)"), 7),
        (("-m", "radiosity_addon", "bake", "--resolution", "0"), 2),
        (("-m", "radiosity_addon", "bake", "--help"), 0),
        (("-m", "radiosity_addon", "restore"), 2),
    ],
)
def test_exit_codes_come_through(arguments: tuple[str, ...], code: int, tmp_path: Path) -> None:
    here = Environment(ROOT, Path(sys.prefix))
    hand_over = "import sys; from pathlib import Path; from build_tools.environments import Environment; "
    hand_over += "sys.exit(Environment(Path(sys.argv[1]), Path(sys.argv[2])).hand_over(*sys.argv[3:]))"
    assert run("-c", hand_over, str(here.root), str(here.folder), *arguments).returncode == code


@pytest.mark.parametrize("arguments", [(), ("frobnicate",), ("test", "--bpy")])
def test_wrong_usage_is_exit_code_2(arguments: tuple[str, ...]) -> None:
    assert run("build.py", *arguments).returncode == 2


def test_help_lists_every_verb() -> None:
    done = run("build.py", "--help")
    assert done.returncode == 0
    verbs = "bake flip restore test bench check figures docs package real-blender"
    for verb in verbs.split():
        assert f"\n  {verb} " in done.stdout


@pytest.mark.parametrize(
    ("arguments", "wanted"),
    [
        ((), {"docs": (), "main": ()}),
        (("--check",), {"docs": ("--check",), "main": ("--check",)}),
        (("quadtree", "--check"), {"docs": ("quadtree", "--check")}),
        (("gallery",), {"main": ()}),
        (("gallery", "metal", "--stale"), {"main": ("metal", "--stale")}),
    ],
)
def test_figures_are_of_the_theory_and_of_the_gallery(
    arguments: tuple[str, ...], wanted: dict[str, tuple[str, ...]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each in its own environment; either may fail the verb."""
    ran: dict[str, tuple[str, ...]] = {}

    class Pretended:
        def __init__(self, name: str) -> None:
            self.name = name

        def run(self, *command: str) -> int:
            ran[self.name] = command[2:] if command[0] == "-m" else command[1:]
            return 1 if self.name == failing else 0

    monkeypatch.syspath_prepend(str(ROOT))
    monkeypatch.chdir(ROOT)
    build = importlib.import_module("build")
    monkeypatch.setattr(environments, "docs_environment", lambda _: Pretended("docs"))
    monkeypatch.setattr(environments, "main_environment", lambda _: Pretended("main"))
    for failing in ("nothing", "docs", "main"):
        ran.clear()
        assert build.figures(list(arguments)) == int(failing in wanted)
        assert ran == wanted


def _must_not_be_called(*arguments: object) -> None:
    raise AssertionError(f"called with {arguments}")
