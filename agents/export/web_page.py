"""The helm as a page of this computer: the newest view goes out, commands come in."""

import asyncio
import json
import secrets
from asyncio import StreamReader, StreamWriter
from collections.abc import Callable
from contextlib import suppress
from http import HTTPStatus

from agents.export.display import KEYS, HelmView, as_json
from agents.export.local_http import (
    HttpError,
    Request,
    json_body,
    read_request,
    response,
)
from shipgym import InputError


class HelmPage:
    """Server of one page, for browsers on this computer that know its token.

    Other requests are refused: those to another host name (DNS rebinding), and those
    that a page from elsewhere makes.

    Parameters
    ----------
    press : callable
        Called with a command, one of `KEYS`.
    title : str
        Heading of the page.
    """

    longest_head = 8192  # bytes
    most_connections = 50
    most_waiting = 65536  # bytes that a client has not taken; then it is dropped
    interval_s = 0.2  # shortest between two views

    def __init__(self, press: Callable[[str], None], title: str) -> None:
        self.press = press
        self.title = title
        self.token = secrets.token_urlsafe(24)
        self.nonce = secrets.token_urlsafe(16)  # of the page's own script and style
        self.port = 0
        self.connections: set[StreamWriter] = set()
        self.listening: set[StreamWriter] = set()  # those that get each view
        self.newest = b""
        self.html = b""
        self._sends_at = 0.0
        self._send_later: asyncio.TimerHandle | None = None
        self._server: asyncio.Server | None = None

    async def open(self, port: int) -> None:
        """Serve at a port, 0 for any that is free; InputError if it is taken."""
        from shipgym.pages import render  # before a ship is steered: it takes a second

        text = render(
            "agents.export/templates/helm.html",
            title=self.title,
            keys=KEYS,
            nonce=self.nonce,
        )
        self.html = text.encode()
        try:
            self._server = await asyncio.start_server(
                self._serve, "127.0.0.1", port, limit=self.longest_head
            )
        except OSError as error:
            raise InputError(
                f"--page: expected a port that is free, got {port}"
                f" ({error.strerror or error}); choose another"
            ) from error
        self.port = self._server.sockets[0].getsockname()[1]

    @property
    def url(self) -> str:
        """Address of the page, with its token."""
        return f"http://127.0.0.1:{self.port}/{self.token}/"

    def show(self, view: HelmView) -> None:
        """Send a view to all, now or a little later."""
        text = json.dumps(as_json(view, self.title), allow_nan=False)
        self.newest = f"data: {text}\n\n".encode()
        loop = asyncio.get_running_loop()
        if self._send_later is None:
            due = max(self._sends_at, loop.time())
            self._send_later = loop.call_at(due, self._send)

    def _send(self) -> None:
        """Send the newest view; drop those that are too slow."""
        self._send_later = None
        self._sends_at = asyncio.get_running_loop().time() + self.interval_s
        for client in list(self.listening):
            if client.transport.get_write_buffer_size() > self.most_waiting:
                self._drop(client)
            else:
                client.write(self.newest)

    def _drop(self, client: StreamWriter) -> None:
        self.listening.discard(client)
        client.transport.abort()

    def close(self) -> None:
        """End the server and all connections."""
        if self._send_later is not None:
            self._send_later.cancel()
        if self._server is not None:
            self._server.close()
        for client in list(self.connections):
            self._drop(client)

    async def _serve(self, reader: StreamReader, writer: StreamWriter) -> None:
        """Answer one request, and go on with it if it listens."""
        patience_s = 10.0
        self.connections.add(writer)
        try:
            async with asyncio.timeout(patience_s):
                answer = await self._answer(reader)
                writer.write(answer or self._events())
                await writer.drain()
            if answer is None:
                self.listening.add(writer)
                writer.write(self.newest)
                while await reader.read(self.longest_head):
                    pass  # until it goes away
        except (OSError, TimeoutError):
            pass
        finally:
            self.connections.discard(writer)
            self.listening.discard(writer)
            writer.close()
            with suppress(OSError):
                await writer.wait_closed()

    async def _answer(self, reader: StreamReader) -> bytes | None:
        """Answer to a request; None to one that listens."""
        try:
            if len(self.connections) > self.most_connections:
                raise HttpError(HTTPStatus.SERVICE_UNAVAILABLE)
            request = await read_request(reader)
            return self._route(request, self._checked_path(request))
        except HttpError as error:
            text = f"{error.status.value} {error}\n".encode()
            return response(error.status, {"Content-Type": "text/plain"}, text)

    def _checked_path(self, request: Request) -> str:
        """Path behind the token; HttpError for a stranger's request."""
        hosts = (f"127.0.0.1:{self.port}", f"localhost:{self.port}")
        host = request.headers.get("host")
        if host not in hosts:
            raise HttpError(HTTPStatus.FORBIDDEN)

        origins = [f"http://{host}" for host in hosts]
        origin = request.headers.get("origin")
        if origin is not None and origin not in origins:
            raise HttpError(HTTPStatus.FORBIDDEN)

        begin, _, rest = request.path.partition("/")
        token, slash, path = rest.partition("/")
        knows_token = secrets.compare_digest(token.encode(), self.token.encode())
        if begin or not slash or not knows_token:
            raise HttpError(HTTPStatus.FORBIDDEN)
        return path

    def _route(self, request: Request, path: str) -> bytes | None:
        """Answer by path and method; None for the events."""
        methods = {"": "GET", "events": "GET", "commands": "POST"}
        if path not in methods:
            raise HttpError(HTTPStatus.NOT_FOUND)
        if request.method != methods[path]:
            raise HttpError(HTTPStatus.METHOD_NOT_ALLOWED)
        if path == "events":
            return None
        if path == "":
            return self._page()

        command = json_body(request).get("command")
        if not isinstance(command, str) or command not in KEYS:
            raise HttpError(HTTPStatus.BAD_REQUEST)
        self.press(command)
        return response(HTTPStatus.NO_CONTENT, {}, None)

    def _page(self) -> bytes:
        policy = [
            "default-src 'none'",
            f"script-src 'nonce-{self.nonce}'",
            f"style-src 'nonce-{self.nonce}'",
            "img-src data:",
            "connect-src 'self'",
            "base-uri 'none'",
            "form-action 'none'",
            "frame-ancestors 'none'",
        ]
        headers = {
            "Content-Type": "text/html; charset=utf-8",
            "Content-Security-Policy": "; ".join(policy),
        }
        return response(HTTPStatus.OK, headers, self.html)

    def _events(self) -> bytes:
        """Head of the events, which follow."""
        return response(HTTPStatus.OK, {"Content-Type": "text/event-stream"}, None)
