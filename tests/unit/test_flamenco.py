"""The Flamenco job type, in Node.js with a stand-in for Flamenco's manager."""

from __future__ import annotations

import json
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


def test_the_bake_comes_first_and_helpers_run_meanwhile() -> None:
    job = compiled(helpers=3)
    bake, *helpers = job["tasks"]
    assert [task["name"] for task in job["tasks"]] == ["bake", "help-1", "help-2", "help-3"]
    assert {task["type"] for task in job["tasks"]} == {"blender"}
    assert all(task["priority"] < bake["priority"] for task in helpers)
    assert not any(task["dependencies"] for task in job["tasks"])


@pytest.mark.parametrize("output", ["/farm/out", "/farm/out/", "R:\\farm\\out\\"])
def test_all_share_one_spool_next_to_the_output(output: str) -> None:
    job = compiled(output=output, options='--quality high --objects "Big Floor" Wall', processes=5)
    spool = f"{output.rstrip('/' + chr(92))}-spool-T0"
    assert job["settings"]["spool"] == spool
    bake, *helpers = (task["commands"] for task in job["tasks"])
    ((command),) = bake
    assert command["name"] == "blender-render"
    said = command["parameters"]
    assert (said["exe"], said["exeArgs"]) == ("{blender}", "{blenderArgs}")
    assert said["blendfile"] == "/farm/a b.blend"
    assert said["argsBefore"] == ["--background"]
    assert said["args"][:2] == ["--command", "radiosity"]
    # Our own command lines understand what is said.
    request = build_parser("blender").parse_args(said["args"][2:])
    assert (request.verb, str(request.spool), request.quality) == ("bake", spool, "high")
    assert str(request.output) == output.rstrip("/" + chr(92))
    assert request.objects == ["Big Floor", "Wall"]
    for (command,) in helpers:
        assert (command["name"], command["parameters"]["exe"]) == ("exec", "{blender}")
        words = command["parameters"]["args"]
        assert words[:3] == ["--background", "--command", "radiosity"]
        request = commands.build_parser("blender").parse_args(words[3:])
        assert (request.verb, str(request.spool), request.processes) == ("worker", spool, 5)
        assert request.wait == 3600


def test_there_may_be_few_helpers_and_no_options() -> None:
    job = compiled(helpers=0, options=None)
    (bake,) = job["tasks"]
    assert bake["commands"][0]["parameters"]["args"][-2] == "--spool"
