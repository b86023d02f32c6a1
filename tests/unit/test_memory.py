"""The hierarchical method stays within its memory limit, or refuses before it allocates."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from radiosity_addon.base.errors import UsageError
from radiosity_addon.rays.embree import EmbreeCaster
from radiosity_addon.solver import PointLight, Scene, SolverSettings
from radiosity_addon.solver.hierarchy.nodes import Hierarchy
from radiosity_addon.solver.links.light_links import link_lights
from radiosity_addon.solver.methods import hierarchical
from radiosity_addon.solver.state.memory import (
    ELEMENT_BYTES,
    FACE_BYTES,
    LIGHT_LINK_BYTES,
    LINK_BYTES,
    least_bytes,
    link_budget,
    refinable,
)
from tests.rooms import box_room, gray, gray_scene

ROOT = Path(__file__).resolve().parents[2]

PEAK = """
import os, sys
try:
    import resource
except ImportError:
    os._exit(3)
import numpy as np
from radiosity_addon.solver import Scene, SolverSettings
from radiosity_addon.solver.methods.hierarchical import solve
from tests.rooms import box_room, gray, sphere

def solve_room(triangles, **more):
    emission = gray(len(triangles), 0.0)
    emission[:2] = 1.0
    scene = Scene(triangles, gray(len(triangles), 0.5), emission)
    return solve(scene, SolverSettings(threads=1, **more))

def peak():
    # Where there is one: a child's ru_maxrss begins at what its parent had.
    try:
        status = open("/proc/self/status").read()
        return int(status.split("VmHWM:")[1].split()[0]) / 2**20
    except OSError:
        pass
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**30 if sys.platform == "darwin" else 2**20)

solve_room(box_room()[0], error=0.01)
before = peak()
chance = np.random.default_rng(5)
balls = [0.05 * sphere(3)[:, ::-1] + chance.uniform(0.1, 0.9, 3) for _ in range(8)]
state = solve_room(np.concatenate([box_room()[0], *balls]), error=1e-6, memory_limit=float(sys.argv[1]))
print(peak() - before, state.n_links, state.over_budget)
sys.stdout.flush()
os._exit(0)
"""


def lit_room(n: int) -> Scene:
    triangles, surface = box_room(n=n)
    emission = gray(len(triangles), 0.0)
    emission[surface == 1] = 1.0
    return gray_scene(triangles, 0.5, emission)


@pytest.mark.full  # a process's peak; the budget and what a link takes are checked by the tests below
def test_a_solution_takes_no_more_than_the_limit() -> None:
    """4,108 faces of clutter, refined until the limit stops it: what the process grows by."""
    limit = 0.25
    run = subprocess.run(
        [sys.executable, "-c", PEAK, str(limit)], cwd=ROOT, capture_output=True, text=True, timeout=300
    )
    if run.returncode == 3:
        pytest.skip("this system does not say how much memory a process took")
    assert run.returncode == 0, run.stderr
    grown, links, over_budget = (float(word) for word in run.stdout.split())
    assert links > 150_000
    assert over_budget > 1e-6
    assert 0.05 < grown <= limit


def test_what_does_not_fit_is_refused_before_anything_is_allocated(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = lit_room(20)
    monkeypatch.setattr(hierarchical, "begin", None)
    with pytest.raises(UsageError, match=r"4,800 faces.*at least 0\.2\d* GiB.*limit of 0\.1 GiB: raise"):
        hierarchical.solve(scene, SolverSettings(memory_limit=0.1, threads=1))


def test_a_small_scene_needs_little() -> None:
    state = hierarchical.solve(lit_room(1), SolverSettings(memory_limit=0.01, error=0.01))
    assert state.residual < 1e-4


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="no such call here")
def test_threads_are_counted_by_the_cores_that_may_be_used() -> None:
    usable = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {min(usable)})
        chosen, single = (least_bytes(10**6, SolverSettings(threads=threads)) for threads in (0, 1))
    finally:
        os.sched_setaffinity(0, usable)
    assert chosen == single


def test_the_budget_is_what_all_else_leaves() -> None:
    hierarchy = Hierarchy(lit_room(20))
    faces = len(hierarchy.faces)
    one, two = (SolverSettings(memory_limit=limit, threads=1, max_links=10**9) for limit in (1.0, 2.0))
    less, more = (link_budget(hierarchy, settings, 0) for settings in (one, two))
    assert more - less == pytest.approx(2**30 / LINK_BYTES, abs=1)
    assert less * LINK_BYTES + faces * FACE_BYTES < 2**30
    assert less - link_budget(hierarchy, one, 1000) == pytest.approx(
        1000 * LIGHT_LINK_BYTES / LINK_BYTES, abs=1
    )
    hierarchy.subdivide(np.arange(faces))
    split = link_budget(hierarchy, one, 0)
    assert less - split == pytest.approx(4 * faces * ELEMENT_BYTES / LINK_BYTES, abs=1)
    # However many are refined at once, links and elements still fit.
    links = split // 2
    room = refinable(hierarchy, one, links, 0)
    assert (links + 3 * room) * LINK_BYTES + 4 * room * ELEMENT_BYTES <= split * LINK_BYTES
    assert room > split // 50
    assert refinable(hierarchy, one, split, 0) == 0


@pytest.mark.parametrize("most", [12, 100, 400])
def test_lamps_split_no_more_elements_than_there_may_be(most: int) -> None:
    """And all light still arrives: the mean irradiance is that of the finest elements."""
    triangles, _ = box_room((2, 2, 2))
    lamp = PointLight((0.9, 1.1, 0.4), 100.0)
    scene = gray_scene(triangles, lights=[lamp])
    caster = EmbreeCaster(triangles, 1)
    hierarchy = Hierarchy(scene)
    links = link_lights(hierarchy, scene.lights, caster, 1e-4, 1e-3, 0, 1, most)
    assert hierarchy.n_elements <= most
    assert hierarchy.n_elements > 0.8 * most
    flux = float((hierarchy.area[links.receiver] * links.gain.mean(axis=1)) @ np.ones(len(links)))
    assert flux * 100.0 == pytest.approx(100.0, rel=0.5 if most == 12 else 0.05)
