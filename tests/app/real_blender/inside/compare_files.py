"""Open two .blend files and write where their contents differ, as a JSON list of lines."""

import json
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from file_dump import differences, dump_file

answer, *files = sys.argv[sys.argv.index("--") + 1 :]
dumps = []
for file in files:
    bpy.ops.wm.open_mainfile(filepath=file)
    dumps.append(dump_file())

Path(answer).write_text(json.dumps(differences(*dumps)))
