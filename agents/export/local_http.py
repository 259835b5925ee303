"""Requests of HTTP/1.1 from this computer, as little of it as one page needs."""

import json
from asyncio import IncompleteReadError, LimitOverrunError, StreamReader
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any, NamedTuple


class Request(NamedTuple):
    """Method, path, headers by their names in small letters, and body."""

    method: str
    path: str
    headers: Mapping[str, str]
    body: bytes


class HttpError(Exception):
    """A request that is answered with a status of its own."""

    def __init__(self, status: HTTPStatus) -> None:
        super().__init__(status.phrase)
        self.status = status


async def read_request(reader: StreamReader) -> Request:
    """Read a request; HttpError for one that is malformed or too long.

    The longest head is the limit of the reader.
    """
    try:
        head = await reader.readuntil(b"\r\n\r\n")
    except LimitOverrunError:
        status = HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE
        raise HttpError(status) from None
    except IncompleteReadError:
        raise ConnectionResetError from None

    first, *lines = head.decode("latin-1").split("\r\n")[:-2]
    words = first.split(" ")
    if len(words) != 3 or not words[2].startswith("HTTP/1."):
        raise HttpError(HTTPStatus.BAD_REQUEST)
    method, path, _ = words
    headers = _headers(lines)

    longest_body = 1000  # bytes
    length = headers.get("content-length", "0")
    is_length = length.isascii() and length.isdigit()
    if not is_length or "transfer-encoding" in headers:
        raise HttpError(HTTPStatus.BAD_REQUEST)
    if len(length) > 9 or int(length) > longest_body:
        raise HttpError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
    try:
        body = await reader.readexactly(int(length))
    except IncompleteReadError:
        raise ConnectionResetError from None
    return Request(method, path, headers, body)


def _headers(lines: list[str]) -> dict[str, str]:
    """Headers by name; HttpError where one stands twice or is malformed."""
    headers: dict[str, str] = {}
    for line in lines:
        name, colon, value = line.partition(":")
        name = name.lower()
        is_name = bool(name) and not any(map(str.isspace, name))
        if not colon or not is_name or name in headers:
            raise HttpError(HTTPStatus.BAD_REQUEST)
        headers[name] = value.strip()
    return headers


def json_body(request: Request) -> dict[str, Any]:
    """Fields of a body in JSON; HttpError for another."""
    kind, _, _ = request.headers.get("content-type", "").partition(";")
    if kind.strip().lower() != "application/json":
        raise HttpError(HTTPStatus.UNSUPPORTED_MEDIA_TYPE)
    try:
        fields = json.loads(request.body)
    except (ValueError, RecursionError):
        raise HttpError(HTTPStatus.BAD_REQUEST) from None
    if not isinstance(fields, dict):
        raise HttpError(HTTPStatus.BAD_REQUEST)
    return fields


def response(
    status: HTTPStatus, headers: Mapping[str, str], body: bytes | None = b""
) -> bytes:
    """Bytes of an answer; without a body (None) one that goes on."""
    lines = [f"HTTP/1.1 {status.value} {status.phrase}"]
    fixed = {
        "Cache-Control": "no-store",
        "Connection": "close",
        "Cross-Origin-Resource-Policy": "same-origin",
        "Referrer-Policy": "no-referrer",
        "X-Content-Type-Options": "nosniff",
        "X-Frame-Options": "DENY",
    }
    if body is not None:
        fixed["Content-Length"] = str(len(body))
    for name, value in {**fixed, **headers}.items():
        lines.append(f"{name}: {value}")
    head = "\r\n".join(lines).encode("ascii")
    return head + b"\r\n\r\n" + (body or b"")
