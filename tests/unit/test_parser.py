"""The command line's parser and exit codes, without Blender."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path
from types import ModuleType

import pytest

from radiosity_addon.base.errors import BakeError, SceneError, UsageError
from radiosity_addon.blender import command_line
from radiosity_addon.blender.command_line.main import main
from radiosity_addon.cli.permissions import Permissions
from radiosity_addon.options.bake_settings import BakeSettings
from tests.processes import run_python

ROOT = Path(__file__).resolve().parents[2]
VERBS = "radiosity_addon.blender.command_line.verbs"


options: list[dict] = []
"""What `bake` got by keyword, call by call."""


@pytest.fixture
def verbs(monkeypatch: pytest.MonkeyPatch) -> list[tuple]:
    """Calls that reach the Blender layer, recorded instead of carried out."""
    calls: list[tuple] = []
    options.clear()
    stand_in = ModuleType(VERBS)
    stand_in.bake = lambda *args, **more: calls.append(("bake", *args)) or options.append(more)
    stand_in.shared_with = lambda *given: given
    stand_in.restore = lambda *args: calls.append(("restore", *args))
    monkeypatch.setitem(sys.modules, VERBS, stand_in)
    monkeypatch.setattr(command_line, "verbs", stand_in, raising=False)
    return calls


def failing(verbs: list[tuple], error: BaseException) -> None:
    """Make `bake` end with this error."""

    def bake(*_: object, **_more: object) -> None:
        raise error

    sys.modules[VERBS].bake = bake


def test_defaults_are_those_of_the_settings(verbs: list[tuple]) -> None:
    assert main(["bake", "room.blend", "--output", "out"]) == 0
    (verb, scene, loaded, output, settings, report, *_) = verbs[0]
    assert (verb, scene, loaded, output, report) == ("bake", Path("room.blend"), None, Path("out"), None)
    assert settings == BakeSettings(
        resolution=512,
        texel_density=None,
        atlas="shared",
        quality="medium",
        quantity="irradiance_over_pi",
        light="all",
        format="exr",
        objects=None,
        sky=False,
        keep_uvs=False,
        seed=0,
        threads=0,
    )


def test_light_groups_arrive_those_of_the_file_and_those_that_are_named(verbs: list[tuple]) -> None:
    line = ["bake", "s.blend", "--output", "o", "--light-groups", "--light-group", "Day=Sun, World"]
    assert main([*line, "--light-group", "Küche=Lamp.001"]) == 0
    settings = verbs[0][4]
    assert settings.light_groups
    assert settings.groups == (("Day", ("Sun", "World")), ("Küche", ("Lamp.001",)))


@pytest.mark.parametrize("text", ["Day", "Day=", "=Sun", "Day= ,"])
def test_a_light_group_needs_a_name_and_members(
    text: str, verbs: list[tuple], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["bake", "s.blend", "--output", "o", "--light-group", text]) == 2
    assert f"--light-group {text}: give a name and what is in it" in capsys.readouterr().err
    assert not verbs


def test_every_option_arrives(verbs: list[tuple]) -> None:
    line = (
        "bake s.glb --output o --texel-density 12.5 --atlas per-object --quality high --quantity radiosity "
        "--light indirect --format png16 --objects Floor Wall --sky --keep-uvs --seed 7 --threads 2 "
        "--quiet --report r.json --plot p.SVG --method two-level --elements 900 --patches 30 --contrast 0.25 "
        "--memory-limit 0.5 --overwrite --allow-scripts"
    )
    assert main(line.split()) == 0
    (_, scene, _, output, settings, report, plot, keep, allowed, console, _) = verbs[0]
    assert (scene, output, console.quiet) == (Path("s.glb"), Path("o"), True)
    assert (report, plot, keep) == (Path("r.json"), Path("p.SVG"), None)
    assert allowed == Permissions(overwrite=True, scripts=True)
    assert settings == BakeSettings(
        texel_density=12.5,
        atlas="per-object",
        quality="high",
        quantity="radiosity",
        light="indirect",
        format="png16",
        objects=("Floor", "Wall"),
        sky=True,
        keep_uvs=True,
        seed=7,
        threads=2,
        method="two-level",
        elements=900,
        patches=30,
        contrast=0.25,
        memory_limit=0.5,
    )


def test_a_bake_has_a_preview_unless_it_is_declined(verbs: list[tuple]) -> None:
    assert main(["bake"]) == 0
    assert main(["bake", "--no-preview"]) == 0
    assert [each["preview"] for each in options] == [True, False]


def test_a_bake_is_kept_if_it_can_be(verbs: list[tuple], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bake", "--keep"]) == 0
    assert verbs[0][-4].sidecar
    assert verbs[0][-3] == Permissions()
    for line, message in (
        ("--keep --method shooting", "needs the hierarchical method"),
        ("--keep --quantity residual", "a residual is of all light together"),
        ("--keep --relight", "not allowed with"),
        ("--relight --plot p.svg", "solves nothing"),
    ):
        assert main(["bake", *line.split()]) == 2
        assert message in capsys.readouterr().err
    assert len(verbs) == 1


@pytest.mark.parametrize(
    ("line", "given"),
    [
        ("hierarchical --link-error 1e-3", {"error": 1e-3}),
        ("hierarchical --min-area 1e-4 --max-links 5000", {"min_area": 1e-4, "max_links": 5000}),
        ("multi-level --form-factor-error 0", {"form_factor_error": 0.0}),
        ("shooting --ambient --max-iterations 90", {"ambient": True, "max_iterations": 90}),
        ("gauss-seidel --assembly linear --tolerance 1e-9", {"assembly": "linear", "tolerance": 1e-9}),
        ("conjugate-gradient --assembly galerkin", {"assembly": "galerkin"}),
        ("dense --elements 12", {"elements": 12}),
    ],
)
def test_a_method_and_its_settings_arrive(line: str, given: dict, verbs: list[tuple]) -> None:
    assert main(["bake", "--method", *line.split()]) == 0
    assert verbs[0][4] == BakeSettings(method=line.split()[0], **given)


def test_the_bundled_scene_has_a_default_output(verbs: list[tuple]) -> None:
    assert main(["bake"]) == 0
    assert verbs[0][1] is None
    assert verbs[0][3] == Path("out/cornell")


def test_a_loaded_file_is_the_scene(verbs: list[tuple]) -> None:
    assert main(["bake", "--output", "o"], loaded=Path("open.blend")) == 0
    assert verbs[0][1:4] == (None, Path("open.blend"), Path("o"))


def test_restore(verbs: list[tuple]) -> None:
    assert main(["restore", "baked.blend", "--output", "back.blend"]) == 0
    assert verbs[0][:4] == ("restore", Path("baked.blend"), None, Path("back.blend"))


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("", "required"),
        ("paint", "paint"),
        ("paint", "COMMAND"),
        ("bake a.blend", "--output"),
        ("bake --output o --objects Wall a.glb", "'a.glb': give SCENE before it"),
        ("bake --output o a.blend --export rgbm,foo", "unknown form 'foo': export one or more of web, glb,"),
        ("bake --output o a.blend --export ,", "no form in ','"),
        ("flip a.blend", "--output"),
        ("bake --output o a.blend extra", "extra"),
        ("bake --resolution 512 --texel-density 3 --output o", "not allowed with"),
        ("bake --resolution 0", "resolution 0"),
        ("bake --resolution 16385", "16384"),
        ("bake --resolution 2k", "2k"),
        ("bake --texel-density 0", "--texel-density"),
        ("bake --texel-density nan", "--texel-density"),
        ("bake --atlas both", "both"),
        ("bake --quality best", "best"),
        ("bake --quantity lux", "lux"),
        ("bake --light some", "some"),
        ("bake --format jpg", "jpg"),
        ("bake --threads -1", "threads -1"),
        ("bake --seed -1", "seed -1"),
        ("bake --method best", "best"),
        ("bake --elements 5", "--elements does not apply to --method hierarchical; it takes --link-error"),
        (
            "bake --method jacobi --ambient",
            "--ambient does not apply to --method jacobi; it takes --elements, --assembly, --tolerance, "
            "--max-iterations, --memory-limit",
        ),
        ("bake --method conjugate-gradient --assembly collocation", "--assembly galerkin"),
        ("bake --method dense --assembly finite", "galerkin, collocation, linear"),
        ("bake --method dense --elements many", "many"),
        ("bake --link-error 0", "--link-error 0.0 is not above 0"),
        ("bake --plot history.jpg", "history.jpg"),
        ("bake --objects", "--objects"),
        ("bake --res 5", "--res"),
        ("restore a.blend", "--output"),
    ],
)
def test_usage_errors_are_one_line_and_2(
    line: str, says: str, verbs: list[tuple], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(line.split()) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert verbs == []
    assert captured.err.startswith("error: ")
    assert captured.err.count("\n") == 1
    assert says in captured.err


@pytest.mark.parametrize("line", ["-h", "bake --help", "restore -h"])
def test_help_is_0(line: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(line.split()) == 0
    assert "usage:" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (SceneError("object 'A'\nis bad"), 1),
        (BakeError("folder 'x' cannot be written"), 1),
        (UsageError("no object 'B'"), 2),
        (MemoryError(), 1),
        (KeyboardInterrupt(), 130),
    ],
)
def test_each_way_to_end_has_its_code(
    error: BaseException, code: int, verbs: list[tuple], capsys: pytest.CaptureFixture[str]
) -> None:
    failing(verbs, error)
    assert main(["bake"]) == code
    err = capsys.readouterr().err
    assert err.startswith("error: ")
    assert err.count("\n") == 1


def test_a_defect_of_ours_shows_its_traceback(verbs: list[tuple], capsys: pytest.CaptureFixture[str]) -> None:
    failing(verbs, ZeroDivisionError("oops"))
    assert main(["bake"]) == 1
    err = capsys.readouterr().err
    assert "Traceback" in err
    assert "ZeroDivisionError: oops" in err.splitlines()[-1]


@pytest.mark.skipif(os.name == "nt", reason="signals are sent the POSIX way")
@pytest.mark.parametrize("swallow", [RuntimeError, SceneError])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_that_a_callback_swallows_still_ends_in_130(
    number: signal.Signals, swallow: type[Exception], verbs: list[tuple]
) -> None:
    def bake(*args: object, **_more: object) -> None:
        args[-1].deferred = False
        try:
            os.kill(os.getpid(), number)
        except KeyboardInterrupt as stop:
            if swallow is SceneError:
                raise SceneError("the importer failed") from stop
        args[-1].check()

    sys.modules[VERBS].bake = bake
    before = signal.getsignal(number)
    assert main(["bake"]) == 130
    assert signal.getsignal(number) is before


@pytest.mark.skipif(os.name == "nt", reason="signals are sent the POSIX way")
def test_a_deferred_stage_is_finished_before_the_interrupt(verbs: list[tuple]) -> None:
    finished = []

    def bake(*args: object, **_more: object) -> None:
        interrupts = args[-1]
        interrupts.deferred = True
        os.kill(os.getpid(), signal.SIGINT)
        finished.append(True)
        interrupts.check()
        finished.append(False)

    sys.modules[VERBS].bake = bake
    assert main(["bake"]) == 130
    assert finished == [True]


def test_parsing_imports_neither_blender_nor_arrays() -> None:
    done = run_python(
        "import sys; from radiosity_addon.blender.command_line.main import main; "
        "code = main(['bake', '--resolution', '0']); "
        "print(code, sorted({m.split('.')[0] for m in sys.modules} & {'bpy', 'numpy', 'embreex', 'xatlas'}))"
    )
    assert done.stdout.strip() == "2 []"


def console_run(body: str) -> str:
    """What a fresh process writes to standard output while a console is open."""
    done = run_python(f"import ctypes, os\nfrom radiosity_addon.cli.console import Console\n{body}")
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.skipif(os.name == "nt", reason="C's own buffer is reached the POSIX way")
def test_console_keeps_other_writers_off_standard_output() -> None:
    out = console_run(
        "print('before')\n"
        "with Console() as c:\n"
        "    os.write(1, b'Fra:1 Mem:22M\\n'); print('chatter'); ctypes.CDLL(None).puts(b'buffered by C')\n"
        "    c.lines(['ours'])\n"
        "print('after')"
    )
    assert out.splitlines() == ["before", "ours", "after"]


@pytest.mark.parametrize(
    ("quiet", "expected"),
    [
        (False, ["[  0 %] export", "[  5 %] links", "[ 15 %] links", "[100 %] links", "done"]),
        (True, []),
    ],
)
def test_progress_off_a_terminal_is_a_line_a_stage_and_a_step(quiet: bool, expected: list[str]) -> None:
    out = console_run(
        f"with Console(quiet={quiet}) as c:\n"
        "    c.progress('export', 0.0)\n"
        "    for f in (0.05, 0.051, 0.1, 0.149, 0.1500001, 1.2): c.progress('links', f)\n"
        "    c.lines(['done'])"
    )
    assert out.splitlines() == expected


def test_summary_says_where_how_long_and_what_to_look_at() -> None:
    from radiosity_addon.cli.console import summary

    report = {
        "objects": [{"object": "Floor"}],
        "solver": {
            "method": "hierarchical",
            "elements": 1200,
            "links": 34000,
            "rays": 5,
            "power_W": {"emitted": 80.0, "absorbed": 60.0, "escaped": 20.1},
        },
        "seconds": {"export": 0.25, "solve": 1.5},
        "warnings": [{"name": "Glass", "message": "not understood; gray used instead"}],
    }
    text = "\n".join(summary("out/x", [("baked.blend", "the scene")], report))
    for part in (
        "1 object baked into out/x",
        "baked.blend",
        "hierarchical: 1,200 elements",
        "34,000 links",
        "light that leaves the scene: 25.1%",
    ):
        assert part in text
    for part in (
        "light that leaves the scene: 25.1%",
        "export",
        "0.25 s",
        "solve",
        "1.50 s",
        "total",
        "1.75 s",
        "1 warning:",
        "Glass: not understood",
    ):
        assert part in text
