"""The Flamenco job type, in Node.js with a stand-in for Flamenco's manager."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from radiosity_addon.cli import build_parser
from radiosity_addon.farm import commands

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "docs" / "flamenco" / "radiosity_bake.js"

SETTING = {
    *("key", "type", "subtype", "choices", "propargs", "description", "label", "default", "eval"),
    *("evalInfo", "visible", "required", "editable"),
}
"""What Flamenco's `AvailableJobSetting` has."""

STAGES = ("prepare", "run", "finish")

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="no Node.js here")


def compiled(**settings: Any) -> dict[str, Any]:
    """Return what the script makes of a job: its type, settings and tasks."""
    given = {"output": "/farm/out", "helpers": 3, "processes": 0, "options": ""}
    request = json.dumps({"blendfile": "/farm/a b.blend", **given, **settings})
    manager = Path(__file__).with_name("flamenco_manager.js")
    words = ["node", str(manager), str(SCRIPT), request]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_it_says_that_it_was_not_run() -> None:
    assert SCRIPT.read_text().startswith("// Not run in Flamenco yet")


def test_its_settings_are_flamencos() -> None:
    job = compiled()["type"]
    assert {"label", "description", "settings"} == set(job)
    keys = [setting["key"] for setting in job["settings"]]
    assert len(set(keys)) == len(keys)
    assert "blendfile" in keys
    for setting in job["settings"]:
        assert set(setting) <= SETTING
        assert setting["type"] in ("string", "int32", "float", "bool")
        assert setting.get("subtype", "dir_path") in ("file_path", "dir_path", "file_name")
        assert setting["visible"] in ("visible", "hidden", "submission", "web")


def test_stages_follow_each_other_and_helpers_work_while_the_bake_runs() -> None:
    tasks = {task["name"]: task for task in compiled(helpers=3)["tasks"]}
    helpers = [f"help-{number}" for number in (1, 2, 3)]
    assert list(tasks) == ["prepare", "run", *helpers, "finish"]
    assert {task["type"] for task in tasks.values()} == {"blender"}
    after = {name: task["dependencies"] for name, task in tasks.items()}
    assert after == {
        "prepare": [],
        "run": ["prepare"],
        **{name: ["prepare"] for name in helpers},
        "finish": ["run"],
    }
    # One machine alone gets from stage to stage, and to the helpers last.
    assert all(tasks[name]["priority"] < tasks[stage]["priority"] for name in helpers for stage in STAGES)


@pytest.mark.parametrize("output", ["/farm/out", "/farm/out/", "R:\\farm\\out\\"])
def test_all_share_one_spool_next_to_the_output(output: str) -> None:
    job = compiled(output=output, options='--quality high --objects "Big Floor" Wall', processes=5)
    folder = output.rstrip("/" + chr(92))
    spool = f"{folder}-spool-T0"
    assert job["settings"]["spool"] == spool
    commands_of = {task["name"]: task["commands"] for task in job["tasks"]}
    # Our own command lines understand what is said.
    with_scene = {}
    for stage in ("prepare", "finish"):
        (command,) = commands_of.pop(stage)
        assert command["name"] == "blender-render"
        said = command["parameters"]
        assert (said["exe"], said["exeArgs"]) == ("{blender}", "{blenderArgs}")
        assert said["blendfile"] == "/farm/a b.blend"
        assert said["argsBefore"] == ["--background"]
        assert said["args"][:2] == ["--command", "radiosity"]
        with_scene[stage] = build_parser("blender").parse_args(said["args"][2:])
        assert (with_scene[stage].verb, str(with_scene[stage].spool)) == (stage, spool)
    assert with_scene["prepare"].quality == "high"
    assert with_scene["prepare"].objects == ["Big Floor", "Wall"]
    assert str(with_scene["finish"].output) == folder
    for name, (command,) in commands_of.items():
        assert (command["name"], command["parameters"]["exe"]) == ("exec", "{blender}")
        words = command["parameters"]["args"]
        assert words[:3] == ["--background", "--command", "radiosity"]
        request = commands.build_parser("blender").parse_args(words[3:])
        assert words[3] in host_commands()
        assert str(request.spool) == spool
        if name == "run":
            assert request.verb == "run"
        else:
            assert (request.verb, request.processes, request.wait) == ("worker", 5, 3600)


def host_commands() -> tuple[str, ...]:
    """Return the commands that Blender passes on to those of spools."""
    source = (ROOT / "radiosity_addon" / "blender" / "command_line" / "host.py").read_text()
    found = re.search(r"OF_SPOOLS = \((.*)\)", source)
    assert found
    return tuple(word.strip(' "') for word in found[1].split(","))


def test_there_may_be_few_helpers_and_no_options() -> None:
    prepare, run, finish = compiled(helpers=0, options=None)["tasks"]
    assert prepare["commands"][0]["parameters"]["args"][-2] == "--spool"
    assert [task["name"] for task in (run, finish)] == ["run", "finish"]
