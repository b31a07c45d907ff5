"""A headless Chromium over its DevTools pipe, for what only a real browser can show."""

import base64
import json
import os
import select
import shutil
import subprocess
import sys
import time

CHROMIUM = next(
    (found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))),
    None,
)  # fmt: skip
FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-gl=angle",
    "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars",
    "--disable-background-networking", "--no-first-run", "--remote-debugging-pipe",
)  # fmt: skip

# The browser reads commands from 3 and writes answers to 4, which may be anything here.
_START = (
    "import os, sys; from fcntl import F_DUPFD, fcntl; "
    "ends = [fcntl(int(end), F_DUPFD, 10) for end in sys.argv[1:3]]; "
    "[os.dup2(end, to) for end, to in zip(ends, (3, 4))]; os.execv(sys.argv[3], sys.argv[3:])"
)


class Browser:
    """One page in one browser; what it logs, and what it asks of the network, is kept."""

    def __init__(self, profile, width=1366, height=900, dark=False):
        self.messages = []
        self.requests = []
        self._count = 0
        self._buffer = b""
        down, self._write = os.pipe()
        self._read, up = os.pipe()
        self._process = subprocess.Popen(
            [sys.executable, "-c", _START, str(down), str(up), CHROMIUM, *FLAGS]
            + [f"--user-data-dir={profile}", f"--window-size={width},{height}"],
            pass_fds=(down, up),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(down)
        os.close(up)
        self._session = None
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)[
            "sessionId"
        ]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=1, mobile=width < 600,
        )  # fmt: skip
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        try:
            self._session = None
            self.call("Browser.close")
        except (OSError, EOFError):
            pass
        try:
            self._process.wait(20)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        os.close(self._read)
        os.close(self._write)

    def call(self, method, **parameters):
        """One DevTools command and its answer."""
        self._count += 1
        order = {"id": self._count, "method": method, "params": parameters}
        if self._session:
            order["sessionId"] = self._session
        os.write(self._write, json.dumps(order).encode() + b"\0")
        while True:
            heard = self._next()
            if heard.get("id") == self._count:
                if "error" in heard:
                    raise AssertionError(f"{method}: {heard['error']}")
                return heard["result"]

    def _next(self, seconds=60):
        while b"\0" not in self._buffer:
            if not select.select([self._read], [], [], seconds)[0]:
                raise EOFError("the browser does not answer")
            got = os.read(self._read, 1 << 20)
            if not got:
                raise EOFError("the browser is gone")
            self._buffer += got
        one, _, self._buffer = self._buffer.partition(b"\0")
        heard = json.loads(one)
        self._keep(heard.get("method"), heard.get("params"))
        return heard

    def _keep(self, method, said):
        if method == "Runtime.consoleAPICalled":
            self.messages.append((said["type"], [a.get("value") for a in said["args"]]))
        elif method == "Runtime.exceptionThrown":
            self.messages.append(("exception", said["exceptionDetails"]))
        elif method == "Log.entryAdded":
            self.messages.append((said["entry"]["level"], said["entry"]["text"]))
        elif method == "Network.requestWillBeSent":
            self.requests.append(said["request"]["url"])

    def open(self, path):
        """Load a file and wait until its viewer runs."""
        self.call("Page.navigate", url=path.resolve().as_uri())
        self.wait(
            "window.mocapSkel && mocapSkel.drawn >= 0 || document.querySelector('#message')?.textContent.includes('cannot')"
        )

    def run(self, script):
        """The value of an expression in the page."""
        found = self.call(
            "Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True
        )
        if "exceptionDetails" in found:
            raise AssertionError(f"{script}: {found['exceptionDetails']}")
        return found["result"].get("value")

    def wait(self, script, seconds=40):
        """Until an expression is true."""
        end = time.monotonic() + seconds
        while not self.run(script):
            assert time.monotonic() < end, f"never true: {script}; {self.messages}"
            time.sleep(0.05)

    def press(self, key, code=None):
        """One key, to whatever has the focus."""
        character = {"text": key} if len(key) == 1 else {}
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=code or key, **character)

    def picture(self, path, full=False):
        """A screenshot as PNG."""
        data = self.call("Page.captureScreenshot", captureBeyondViewport=full)["data"]
        path.write_bytes(base64.b64decode(data))
