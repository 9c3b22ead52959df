"""Headless Chromium, driven by its own protocol over a socket: for tests of pages."""

import itertools
import json
import shutil
import subprocess
import tempfile
import time
import urllib.request
from contextlib import contextmanager
from pathlib import Path

import pytest

PROGRAMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
OPTIONS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
    "--remote-debugging-port=0", "--remote-allow-origins=*", "--window-size=1280,1000",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
)  # fmt: skip


class Page:
    """One tab."""

    def __init__(self, socket):
        self.socket, self.numbers, self.errors, self.requests = socket, itertools.count(1), [], []
        for domain in ("Runtime", "Log", "Page", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method, **parameters):
        """Ask the browser, and take note of what it says in between."""
        number = next(self.numbers)
        self.socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            said = json.loads(self.socket.recv())
            if said.get("id") == number:
                assert "error" not in said, said
                return said["result"]
            self.note(said)

    def note(self, said):
        method, what = said.get("method"), said.get("params", {})
        if method == "Runtime.exceptionThrown":
            self.errors.append(what["exceptionDetails"])
        elif method == "Runtime.consoleAPICalled" and what["type"] in ("error", "warning", "assert"):
            self.errors.append(what["args"])
        elif method == "Log.entryAdded" and what["entry"]["level"] == "error":
            self.errors.append(what["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            self.requests.append(what["request"]["url"])

    def open(self, path):
        self.errors.clear()
        self.requests.clear()
        self.call("Page.navigate", url="about:blank")
        self.call("Page.navigate", url=Path(path).resolve().as_uri())
        self.wait("document.readyState === 'complete' && !!window.report")

    def run(self, code):
        answer = self.call("Runtime.evaluate", expression=code, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait(self, code, seconds=20.0):
        end = time.perf_counter() + seconds
        while not self.run(code):
            assert time.perf_counter() < end, f"not within {seconds} s: {code}"
            time.sleep(0.05)

    def press(self, key, code=None, shift=False):
        text = {"text": key} if len(key) == 1 else {}
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=code or key, modifiers=8 * shift, **text)


@contextmanager
def browser():
    """A page of a fresh browser; the test is skipped where there is none."""
    websocket = pytest.importorskip("websocket")
    program = next(filter(None, map(shutil.which, PROGRAMS)), None)
    if program is None:
        pytest.skip("no Chromium")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        with subprocess.Popen(
            [program, *OPTIONS, f"--user-data-dir={folder}", "about:blank"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        ) as process:
            try:
                port = _port(Path(folder) / "DevToolsActivePort")
                with urllib.request.urlopen(f"http://127.0.0.1:{port}/json/list", timeout=10) as answer:
                    tab = next(tab for tab in json.load(answer) if tab["type"] == "page")
                socket = websocket.create_connection(tab["webSocketDebuggerUrl"], timeout=30)
                try:
                    yield Page(socket)
                finally:
                    socket.close()
            finally:
                process.terminate()


def _port(path):
    end = time.perf_counter() + 30
    while not (path.exists() and path.read_text().strip()):
        assert time.perf_counter() < end, "Chromium did not start within 30 s"
        time.sleep(0.05)
    return int(path.read_text().split()[0])
