"""A real Chromium that draws exports with software WebGL, without network, and sends pixels back."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from queue import Empty, Queue
from urllib.parse import urlencode, urlsplit

import numpy as np
import pytest

from build_tools import viewer_bundle

ROOT = Path(__file__).resolve().parents[2]
NAMES = ("chromium", "chromium-browser", "google-chrome")
OPTIONS = (
    "--headless=new",
    "--no-sandbox",
    "--no-first-run",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    # No name resolves: what is fetched from elsewhere fails.
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
)
WAIT = 240


def chromium() -> str:
    """The path of a Chromium; skips where there is none, or no npm for the pages."""
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        pytest.skip("no Chromium (Debian: apt-get install chromium)")
    if shutil.which("npm") is None:
        pytest.skip("no npm (Debian: apt-get install npm)")
    return found


def bundled(name: str, folder: Path) -> Path:
    """Bundle a page's program; returns the script."""
    target = folder / f"{name}.js"
    viewer_bundle.bundle(ROOT, target, Path(__file__).parent / f"{name}.js")
    return target


class Server:
    """Serves an export and a page's program, and takes what the page posts."""

    def __init__(self, export: Path, program: Path) -> None:
        self.posted: Queue[tuple[str, bytes]] = Queue()
        page = b"<!doctype html><meta charset=utf-8><body><script src=/program.js></script>"

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                path = urlsplit(self.path).path
                file = program if path == "/program.js" else export / path.removeprefix("/export/")
                found = page if path == "/" else file.read_bytes() if file.is_file() else None
                self.send_response(404 if found is None else 200)
                kind = (
                    "text/html"
                    if path == "/"
                    else "text/javascript"
                    if path.endswith(".js")
                    else "application/octet-stream"
                )
                self.send_header("Content-Type", kind)
                self.end_headers()
                self.wfile.write(found or b"")

            def do_POST(self) -> None:
                posted.put((self.path, self.rfile.read(int(self.headers["Content-Length"]))))
                self.send_response(204)
                self.end_headers()

            def log_message(self, *_: object) -> None:
                pass

        posted = self.posted
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.address = f"http://127.0.0.1:{self._server.server_address[1]}/"
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()


def drawn(export: Path, program: Path, width: int, height: int, **asked: str) -> np.ndarray:
    """Draw an export in a page; returns (height, width, 4) float32, row 0 at the bottom."""
    server = Server(export, program)
    with tempfile.TemporaryDirectory() as profile:
        query = urlencode({**asked, "width": width, "height": height})
        command = [chromium(), *OPTIONS, f"--user-data-dir={profile}", f"{server.address}?{query}"]
        browser = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            path, data = server.posted.get(timeout=WAIT)
        except Empty:
            pytest.fail(f"the page {asked} posted nothing in {WAIT} s")
        finally:
            browser.terminate()
            browser.wait()
            server.close()
    assert path == "/result", data.decode(errors="replace")
    return np.frombuffer(data, "<f4").reshape(height, width, 4)


def screenshot(page: Path, target: Path, width: int = 1000, height: int = 700) -> None:
    """Take a picture of a page that is opened from the disk."""
    with tempfile.TemporaryDirectory() as profile:
        command = [chromium(), *OPTIONS, f"--user-data-dir={profile}", f"--window-size={width},{height}"]
        command += ["--virtual-time-budget=20000", f"--screenshot={target}", page.resolve().as_uri()]
        subprocess.run(
            command, check=True, timeout=WAIT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
