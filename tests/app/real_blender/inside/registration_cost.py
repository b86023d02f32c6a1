"""Switch the extension off and on with nothing of it loaded: its processor time, and what it imports.

Next to that, what a fixed piece of Python's work takes, to know how fast the machine is.
"""

import json
import sys
import time
from pathlib import Path

import addon_utils

MODULE = "bl_ext.user_default.radiosity_addon"

SOURCE = Path(addon_utils.__file__).read_text()

answer = {"enabled": addon_utils.check(MODULE), "seconds": [], "compiling": []}
for _ in range(5):
    addon_utils.disable(MODULE)
    for name in [name for name in sys.modules if name.startswith(MODULE)]:
        del sys.modules[name]
    start = time.process_time()
    addon_utils.enable(MODULE)
    answer["seconds"].append(time.process_time() - start)
    start = time.process_time()
    compile(SOURCE, "addon_utils", "exec")
    answer["compiling"].append(time.process_time() - start)
answer["modules"] = sorted(name.removeprefix(f"{MODULE}.") for name in sys.modules)

# The wheels are there all the same.
import embreex  # noqa: E402
import xatlas  # noqa: E402

answer["wheels"] = [embreex.__file__, xatlas.__file__]

Path(sys.argv[sys.argv.index("--") + 1]).write_text(json.dumps(answer))
