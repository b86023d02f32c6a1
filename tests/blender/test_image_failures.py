"""Images that cannot be written: one line says so, and names the file by the path that the user knows."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.processes import run_python

ROOT = Path(__file__).resolve().parents[2]

# No file may become longer than this, as on a disk with so much room.
CODE = """
import os, resource, sys
from pathlib import Path
import bpy
import numpy as np
from radiosity_addon.blender.images.images import save_image
from radiosity_addon.base.errors import BakeError

image = bpy.data.images.new("page", 64, 64, float_buffer=True, is_data=True)
image.pixels.foreach_set(np.random.default_rng(0).random(64 * 64 * 4, dtype=np.float32))
image.file_format = sys.argv[2]
resource.setrlimit(resource.RLIMIT_FSIZE, (500, 500))
code = 0
try:
    save_image(image, Path(sys.argv[1]))
except BakeError as error:
    os.write(1, str(error).encode())
    code = 1
os._exit(code)
"""


@pytest.mark.skipif(os.name == "nt", reason="limits the size of files as POSIX does")
@pytest.mark.parametrize("kind", ["OPEN_EXR", "PNG"])
def test_one_line_says_that_an_image_could_not_be_written(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "page"
    done = run_python(CODE, path, kind)
    assert done.stderr == ""
    assert done.stdout.splitlines() == [done.stdout]
    assert done.stdout.startswith(f"cannot write '{path}': ")
    assert done.returncode == 1
