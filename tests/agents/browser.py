"""The system's Chromium, headless and offline, driven by Playwright."""

from __future__ import annotations

import shutil
import time
from typing import Any

from playwright.sync_api import Error, sync_playwright

COMMAND = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))),
    None,
)
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
)
PATIENCE = 60.0  # s, for an answer
FRAME = (
    "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
)


class Browser:
    """One page; what it said on the console, threw and asked for is kept."""

    def __init__(self, width: int = 1000, height: int = 700) -> None:
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self._playwright = sync_playwright().start()
        try:
            self._browser = self._playwright.chromium.launch(
                executable_path=COMMAND, args=list(FLAGS)
            )
            self.page = self._browser.new_page(
                viewport={"width": width, "height": height}
            )
        except BaseException:
            self._playwright.stop()
            raise
        self.page.set_default_timeout(1000.0 * PATIENCE)
        self.page.on("console", self._said)
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self._session = self.page.context.new_cdp_session(self.page)

    def _said(self, message: Any) -> None:
        if message.type in ("error", "warning", "assert"):
            self.complaints.append(message.text)

    def ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        """The answer to a DevTools command."""
        answer: dict[str, Any] = self._session.send(method, parameters)
        return answer

    def open(self, address: str) -> None:
        """Load a page and wait until it is there."""
        self.requests.clear()
        self.complaints.clear()
        self.page.goto(address)

    def run(self, script: str) -> Any:
        """The value of an expression in the page, after its next frame."""
        return self.page.evaluate(f"{FRAME}.then(() => ({script}))")

    def wait(self, condition: str) -> None:
        """Wait until an expression is true."""
        end = time.monotonic() + PATIENCE
        while not self._holds(condition):
            if time.monotonic() > end:
                raise TimeoutError(f"never true: {condition}")

    def _holds(self, condition: str) -> bool:
        try:
            return bool(self.run(condition))
        except Error as error:
            if "context" in str(error):  # that of a page which is just being left
                return False
            raise

    def press(self, key: str) -> None:
        """Press a key, such as "Space" or "Shift+ArrowRight"."""
        self.page.keyboard.press(key)

    def click(self, selector: str, across: float = 0.5) -> None:
        """Click an element, so far across it from its left."""
        box = self.page.locator(selector).first.bounding_box()
        assert box is not None
        self.page.mouse.click(
            box["x"] + across * box["width"], box["y"] + 0.5 * box["height"]
        )

    def resize(self, width: int, height: int, mobile: bool = False) -> None:
        """Another window, or the screen of a telephone."""
        self.ask(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=mobile,
        )

    def close(self) -> None:
        """End the browser."""
        self._browser.close()
        self._playwright.stop()
