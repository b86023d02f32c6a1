"""A real Chromium that draws exports with software WebGL, without network, and sends pixels back."""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from queue import Empty, Queue
from typing import Any
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


def drawn(export: Path, program: Path, width: int, height: int, finer: int = 1, **asked: str) -> np.ndarray:
    """Draw an export in a page; returns (height, width, 4) float32, row 0 at the bottom.

    finer: Odd; the page draws so many times larger, and pixels are those at the centers. Software WebGL
        places corners of triangles at sixteenths of a pixel, which moves fine images by as much.
    """
    width, height = finer * width, finer * height
    server = Server(export, program)
    # Helpers of Chromium may still write while the folder is removed.
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
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
    return np.frombuffer(data, "<f4").reshape(height, width, 4)[finer // 2 :: finer, finer // 2 :: finer]


@contextmanager
def viewer(page: Path, width: int = 1000, height: int = 700) -> Iterator[Viewer]:
    """Open a viewer from the disk, and yield it once it has loaded its scene."""
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile,
        Remote(profile, width, height) as browser,
    ):
        shown = Viewer(browser, browser.opened(page.resolve().as_uri()))
        until = time.monotonic() + WAIT
        while shown.evaluated("typeof viewer") != "object":
            message = shown.evaluated("document.getElementById('message').textContent")
            assert time.monotonic() < until, f"the viewer says: {message}"
            assert "cannot" not in (message or ""), message  # it is gone once the scene is shown
            time.sleep(0.2)
        yield shown


@dataclass(frozen=True, eq=False)
class Viewer:
    """A viewer that shows a scene."""

    browser: Remote
    session: str

    def evaluated(self, expression: str) -> Any:
        """Evaluate an expression in the page."""
        return self.browser.evaluated(self.session, expression)

    def point_at(self, x: int, y: int) -> None:
        """Move the pointer."""
        self.browser.call("Input.dispatchMouseEvent", self.session, type="mouseMoved", x=x, y=y)

    def picture(self) -> bytes:
        """Return a PNG of it."""
        return base64.b64decode(self.browser.call("Page.captureScreenshot", session=self.session)["data"])


class Remote:
    """A Chromium that is driven by its DevTools protocol, over pipes."""

    def __init__(self, profile: str, width: int, height: int) -> None:
        read_by_it, self._write = os.pipe()
        self._read, written_by_it = os.pipe()
        command = [chromium(), *OPTIONS, f"--user-data-dir={profile}", f"--window-size={width},{height}"]
        # It wants these two numbers.
        redirect = f'exec 3<&{read_by_it} 4>&{written_by_it}; exec "$@"'
        self._process = subprocess.Popen(
            ["bash", "-c", redirect, "bash", *command, "--remote-debugging-pipe"],
            pass_fds=(read_by_it, written_by_it),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(read_by_it)
        os.close(written_by_it)
        self._size = width, height
        self._answers = os.fdopen(self._read, "rb")
        self._number = 0

    def __enter__(self) -> Remote:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        self._process.wait()
        self._answers.close()
        os.close(self._write)

    def call(self, method: str, session: str = "", **parameters: Any) -> Any:
        """Call a method and return its result."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        os.write(
            self._write,
            json.dumps({**message, **({"sessionId": session} if session else {})}).encode() + b"\0",
        )
        while True:
            answer = json.loads(self._message())
            if answer.get("id") == self._number:
                assert "error" not in answer, answer["error"]
                return answer["result"]

    def opened(self, address: str) -> str:
        """Open a page; returns its session."""
        width, height = self._size
        target = self.call("Target.createTarget", url=address)["targetId"]
        session: str = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.call("Emulation.setDeviceMetricsOverride", session, **size)
        return session

    def evaluated(self, session: str, expression: str) -> Any:
        """Evaluate an expression in a page."""
        result = self.call("Runtime.evaluate", session, expression=expression, returnByValue=True)
        return result["result"].get("value")

    def _message(self) -> bytes:
        found = bytearray()
        while (byte := self._answers.read(1)) != b"\0":
            assert byte, "Chromium has ended"
            found += byte
        return bytes(found)
