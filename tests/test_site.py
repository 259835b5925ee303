"""The built site in a browser. `make docs` builds it and runs this; `make test` leaves
it out.

`SHIPGYM_SITE` names a folder that is built already; otherwise it is built here, in half
a minute.
"""

import functools
import http.server
import os
import subprocess
import sys
import threading
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from tests.agents.browser import COMMAND, Browser

pytest.importorskip(
    "mkdocs", reason="the site is built by mkdocs: pip install 'shipgym[docs]'"
)

ROOT = Path(__file__).parents[1]
BOX = "e.getBoundingClientRect()"
WIDE, TELEPHONE = (1280, 800), (375, 667)
NARROW = (
    "index.html",
    "tutorial.html",
    "identification.html",
    "reproduction.html",
    "theory/motion.html",
    "theory/identification.html",
    "theory/autopilots.html",
    "howto/control_loop.html",
    "api/shipgym.html",
    "notebooks/identify.html",
)


class Page(HTMLParser):
    """Anchors, links, and what a page loads."""

    def __init__(self, path):
        super().__init__()
        self.anchors, self.links, self.loads = set(), set(), set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.anchors |= {found[key] for key in ("id", "name") if found.get(key)}
        if tag == "a" and found.get("href"):
            self.links.add(found["href"])
        elif tag in ("img", "script", "iframe") and found.get("src"):
            self.loads.add(found["src"])
        elif tag == "link" and found.get("rel") != "canonical" and found.get("href"):
            self.loads.add(found["href"])


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    if built := os.environ.get("SHIPGYM_SITE"):
        return Path(built).resolve()
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "mkdocs",
            "build",
            "--strict",
            "--quiet",
            "--site-dir",
            str(folder),
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
    )
    assert done.returncode == 0, done.stderr
    return folder


class Quiet(http.server.SimpleHTTPRequestHandler):
    """A server that logs nothing."""

    def log_message(self, *_):
        pass


@pytest.fixture(scope="module")
def address(site):
    server = http.server.ThreadingHTTPServer(
        ("127.0.0.1", 0), functools.partial(Quiet, directory=site)
    )
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    server.server_close()


@pytest.fixture(scope="module")
def browser():
    if COMMAND is None:
        pytest.skip("no Chromium on this computer")
    found = Browser(*WIDE)
    yield found
    found.close()


def test_links_lead_somewhere_and_nothing_is_loaded_from_elsewhere(site):
    pages = {path: Page(path) for path in site.rglob("*.html")}
    broken = []
    for path, page in pages.items():
        if path.name == "404.html":  # its links are from the root of a server
            continue
        for link in page.links | page.loads:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                broken += (
                    [(path.name, link)]
                    if link in page.loads and parts.scheme != "data"
                    else []
                )
                continue
            target = (
                (path.parent / unquote(parts.path)).resolve() if parts.path else path
            )
            if not target.exists() or (
                parts.fragment
                and target in pages
                and unquote(parts.fragment) not in pages[target].anchors
            ):
                broken.append((path.relative_to(site).as_posix(), link))
    assert len(pages) > 30
    assert not broken


def test_the_first_page_says_all_without_scrolling(browser, address):
    browser.open(f"{address}/index.html")
    bottoms = browser.run(
        "[...document.querySelectorAll('.cards li')].map(e =>"
        " e.getBoundingClientRect().bottom)"
    )
    assert len(bottoms) == 3
    assert max(bottoms) <= WIDE[1]
    picture = browser.run(
        "(e => [e.complete && e.naturalWidth, e.getBoundingClientRect().top])"
        "(document.querySelector('.banner'))"
    )
    assert picture[0] > 0
    assert picture[1] > 0


def test_pages_fit_a_telephone_and_say_nothing_on_the_console(browser, address):
    browser.resize(*TELEPHONE, mobile=True)
    try:
        for page in NARROW:
            browser.open(f"{address}/{page}")
            assert (
                browser.run("document.documentElement.scrollWidth") <= TELEPHONE[0]
            ), page
            assert not browser.complaints, (page, browser.complaints)
            assert all(
                url.startswith((address, "data:", "blob:")) for url in browser.requests
            ), page
    finally:
        browser.resize(*WIDE)


def test_equations_are_drawn(browser, address):
    browser.open(f"{address}/theory/identification.html")
    sizes = browser.run(
        "[...document.querySelectorAll('math')].map(e =>"
        " e.getBoundingClientRect().width)"
    )
    assert len(sizes) > 20
    assert min(sizes) > 3
    text = browser.run("document.querySelector('article').innerText")
    assert "\\frac" not in text
    assert "$" not in text


def test_dark_and_light(browser, address):
    browser.open(f"{address}/certainty.html")
    brightness = (
        "getComputedStyle(document.body).backgroundColor.match(/\\d+/g).slice(0,"
        " 3).map(Number)"
    )
    light = browser.run(brightness)
    browser.click("label.md-header__button[for^=__palette]:not([hidden])")
    browser.wait("document.body.dataset.mdColorScheme === 'slate'")
    assert min(light) > 200
    assert max(browser.run(brightness)) < 80
    browser.click("label.md-header__button[for^=__palette]:not([hidden])")
    browser.wait("document.body.dataset.mdColorScheme === 'default'")


def test_a_word_is_found(browser, address):
    browser.open(f"{address}/index.html")
    browser.page.locator("input.md-search__input").fill("overshoot")
    browser.wait("document.querySelectorAll('.md-search-result__item').length > 2")
    items = "[...document.querySelectorAll('.md-search-result__item')]"
    found = browser.run(f"{items}.map((one) => one.textContent)")
    assert all("overshoot" in text.lower() for text in found[:3])


def test_figures_are_drawn_when_printed(browser, address):
    browser.open(f"{address}/environments/course_keeping.html")
    pictures = browser.run("document.querySelectorAll('article img').length")
    printed = browser.page.pdf()
    assert pictures > 0
    assert printed.count(b"/Subtype /Image") >= pictures
