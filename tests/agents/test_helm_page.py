"""The helm as a page: whom it answers, what it takes, and how a browser shows it."""

import asyncio
import json
import socket
import threading

import pytest
from typer.testing import CliRunner

from agents import PID
from agents.cli import app
from agents.export.display import KEYS
from agents.export.web_page import HelmPage
from shipgym.errors import InputError
from tests.agents.browser import COMMAND, Browser
from tests.agents.policies import MARINER
from tests.agents.test_helm_display import COMPASS, OTHERS, Watched


def run(body):
    """A test of an open page, with the commands that came and a helm to show."""

    async def with_page():
        pressed = []
        page = HelmPage(pressed.append, "shipgym steer pid")
        await page.open(0)
        try:
            page.show(Watched().tick(COMPASS, *OTHERS))
            return await body(page, pressed)
        finally:
            page.close()

    return asyncio.run(with_page())


async def connect(page, request, **headers):
    """Send a request; reader and writer of its connection."""
    host = f"127.0.0.1:{page.port}"
    lines = [f"{name}: {value}" for name, value in {"Host": host, **headers}.items()]
    first, _, body = request.partition("\n")
    text = "\r\n".join([f"{first} HTTP/1.1", *lines, "", body])
    reader, writer = await asyncio.open_connection("127.0.0.1", page.port)
    writer.write(text.encode("latin-1"))
    return reader, writer


async def ask(page, request, **headers):
    """Answer to a request: its status and the rest."""
    reader, writer = await connect(page, request, **headers)
    answer = await asyncio.wait_for(reader.read(), 5.0)
    writer.close()
    head, _, rest = answer.decode().partition("\r\n\r\n")
    return int(head.split()[1]), f"{head}\n{rest}"


def post(command, kind="application/json"):
    body = json.dumps({"command": command})
    return f"POST /TOKEN/commands\n{body}", {
        "Content-Type": kind,
        "Content-Length": str(len(body)),
    }


STEER, STEER_HEADERS = post("steer")


@pytest.mark.parametrize(
    ("request_text", "headers", "status"),
    [
        ("GET /TOKEN/", {}, 200),
        ("GET /TOKEN/", {"Host": "localhost:PORT"}, 200),
        ("GET /TOKEN/", {"Origin": "http://127.0.0.1:PORT"}, 200),
        ("GET /", {}, 403),
        ("GET /TOKENx/", {}, 403),
        ("GET /events", {}, 403),
        ("GET /é/", {}, 403),
        ("GET /TOKEN/", {"Host": "evil.example:PORT"}, 403),
        ("GET /TOKEN/", {"Host": "127.0.0.1"}, 403),
        ("GET /TOKEN/", {"Host": ""}, 403),
        ("GET /TOKEN/events", {"Origin": "http://evil.example"}, 403),
        ("GET /TOKEN/", {"Origin": "null"}, 403),
        ("GET /TOKEN/../secret", {}, 404),
        ("GET /TOKEN/commands", {}, 405),
        ("POST /TOKEN/", {}, 405),
        (STEER, STEER_HEADERS, 204),
        (STEER.replace("TOKEN", "x"), STEER_HEADERS, 403),
        (STEER, {**STEER_HEADERS, "Origin": "https://127.0.0.1:PORT"}, 403),
        (STEER, {**STEER_HEADERS, "Host": "rebound.example"}, 403),
        (STEER, {**STEER_HEADERS, "Content-Type": "text/plain"}, 415),
        (STEER, {**STEER_HEADERS, "Content-Length": "1000000"}, 413),
        (STEER, {**STEER_HEADERS, "Content-Length": "-1"}, 400),
        (STEER, {**STEER_HEADERS, "Transfer-Encoding": "chunked"}, 400),
        (STEER, {**STEER_HEADERS, "Content-Length": "5"}, 400),
        (*post("sink"), 400),
        (*post(["steer"]), 400),
        ("GET /TOKEN/", {"X": "y" * 9000}, 431),
        ("GET /TOKEN/ x", {}, 400),
        ("GET /TOKEN/", {"host": "127.0.0.1:PORT"}, 400),  # twice
    ],
)
def test_only_those_who_know_the_token_are_answered(request_text, headers, status):
    async def body(page, pressed):
        sent = {
            name: value.replace("PORT", str(page.port))
            for name, value in headers.items()
        }
        text = request_text.replace("TOKEN", page.token)
        found, answer = await ask(page, text, **sent)
        assert page.token not in answer
        return found, pressed

    assert run(body) == (status, ["steer"] if status == 204 else [])


def test_the_page_loads_nothing_else_and_is_framed_by_nobody():
    async def body(page, _):
        return await ask(page, f"GET /{page.token}/")

    _, answer = run(body)
    for part in (
        "default-src 'none'",
        "frame-ancestors 'none'",
        "Referrer-Policy: no-referrer",
        "Cache-Control: no-store",
    ):
        assert part in answer
    assert "http://" not in answer
    assert "https://" not in answer
    assert "unsafe" not in answer


def test_a_listener_gets_the_view_of_now_and_each_that_follows():
    async def body(page, _):
        reader, writer = await connect(page, f"GET /{page.token}/events")
        await reader.readuntil(b"\r\n\r\n")
        views = []
        watched = Watched()
        for _ in range(2):
            event = await asyncio.wait_for(reader.readuntil(b"\n\n"), 5.0)
            views.append(json.loads(event.removeprefix(b"data: ")))
            page.show(watched.tick(*OTHERS))
        writer.close()
        return views

    first, second = run(body)
    assert first["headline"] == "STEERING"
    assert first["gauges"]["heading"] == "045.0°"
    assert second["headline"] == "STAND-BY"
    assert second["missing"] == [{"quantity": "heading", "heard": "nothing heard"}]


def test_a_slow_listener_is_dropped_and_many_come_and_go():
    async def body(page, _):
        page.interval_s = 0.0
        view = Watched().tick(COMPASS, *OTHERS)
        _, slow = await connect(page, f"GET /{page.token}/events")
        while not page.listening:
            await asyncio.sleep(0.01)
        (client,) = page.listening
        most = 0
        for _ in range(100_000):  # it never reads
            page.show(view)
            await asyncio.sleep(0)
            most = max(most, client.transport.get_write_buffer_size())
            if not page.listening:
                break
        slow.close()
        others = [
            await connect(page, f"GET /{page.token}/events")
            for _ in range(2 * page.most_connections)
        ]
        await asyncio.sleep(0.1)
        kept = len(page.connections)
        for _, writer in others:
            writer.close()
        while page.connections:
            await asyncio.sleep(0.01)
        return most, kept

    most, kept = run(body)
    assert most < HelmPage.most_waiting + 5000
    assert kept <= HelmPage.most_connections


def test_a_port_that_is_taken_ends_it_before_anything_is_steered(tmp_path):
    PID.from_model(MARINER).save(tmp_path / "pid.json")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        command = ["steer", str(tmp_path / "pid.json"), "--nmea", "udp:127.0.0.1:1"]
        result = CliRunner().invoke(app, [*command, "--page", str(port)])
    assert result.exit_code == 2
    (line,) = result.stderr.splitlines()
    assert f"--page: expected a port that is free, got {port}" in line


@pytest.fixture(scope="module")
def steered():
    """A page served by a thread, and a helm to press the keys of."""
    watched = Watched()
    loop = asyncio.new_event_loop()
    page = HelmPage(watched.panel.press, "</script><b>pid")
    watched.panel.displays.append(page.show)
    thread = threading.Thread(target=loop.run_forever)
    thread.start()
    asyncio.run_coroutine_threadsafe(page.open(0), loop).result()

    def tick(*lines):
        async def once():
            watched.tick(*lines, seconds=0.5)

        asyncio.run_coroutine_threadsafe(once(), loop).result()

    yield page, tick

    async def ends():
        page.close()
        await asyncio.sleep(0.05)

    asyncio.run_coroutine_threadsafe(ends(), loop).result()
    loop.call_soon_threadsafe(loop.stop)
    thread.join()
    loop.close()


@pytest.mark.skipif(COMMAND is None, reason="no chromium is installed")
def test_a_browser_shows_the_helm_and_its_buttons_steer_it(steered):
    page, tick = steered
    browser = Browser(900, 900)

    def headline(text):
        browser.wait(f"find('headline').textContent === '{text}'")

    try:
        tick(COMPASS, *OTHERS)
        browser.open(page.url)
        headline("STEERING")
        assert browser.run("find('title').textContent") == "</script><b>pid"
        assert browser.run("document.querySelectorAll('button').length") == len(KEYS)

        browser.click("#starboard-10")
        browser.wait("find('gauges').textContent.includes('061.6°')")
        browser.press("-")
        browser.wait("find('gauges').textContent.includes('060.6°')")
        browser.press("Space")
        headline("STAND-BY")
        browser.click("#steer")
        headline("STEERING")

        assert browser.run("find('question').hidden")
        browser.press("q")
        browser.wait("!find('question').hidden")
        browser.click("#cancel")
        browser.wait("find('question').hidden")

        for _ in range(9):
            tick(*OTHERS)
        headline("ALARM: TAKE THE WHEEL")
        browser.wait("find('sources').textContent.includes('HEHDT: silent')")
        browser.run("heardAt -= longestSilence")  # nothing comes for some time
        headline("NO CONTACT")
        assert browser.complaints == []
        assert all(one.startswith(page.url) for one in browser.requests)
    finally:
        browser.close()


def test_a_port_out_of_range_is_no_port():
    async def body(page, _):
        other = HelmPage(print, "another")
        await other.open(page.port)

    with pytest.raises(InputError, match="choose another"):
        run(body)
