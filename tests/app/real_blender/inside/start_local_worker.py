"""Start a worker of the installed extension in Blender's Python, and have it end with its bake."""

import json
import sys
import time
from pathlib import Path

from bl_ext.user_default.radiosity_addon.farm import Spool
from bl_ext.user_default.radiosity_addon.farm.local_workers import start_worker

answer, folder = (Path(word) for word in sys.argv[sys.argv.index("--") + 1 :])
spool = Spool.to_bake(folder)
spool.say_over()
worker = start_worker(spool)
end = time.monotonic() + 60
while worker.code is None and time.monotonic() < end:
    time.sleep(0.05)
answer.write_text(json.dumps({"code": worker.code, "said": worker.last_words()}))
worker.end()
