"""One change to a file, by its format: JSON, TOML, CSV, safetensors, bytes."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from random import Random
from typing import Any

from shipgym.files import parse_toml

BYTES_SHARE = 0.12  # of changes that know nothing of the format
LARGEST_TOML = 10_000  # bytes that are parsed for a change
NUMBERS: tuple[Any, ...] = (
    *(0, -0.0, 1, -1, 2, 0.5, 1e-9, 5e-324, 1e9, 1e300, -1e308, 255, 2**31),
    *(2**53 + 1, 2**63, 2**64, 10**30, float("nan"), float("inf"), -float("inf")),
)
TEXTS = (
    *("", " ", "\n", '"', "'''", "\\", "\0", "\ud800", "\x1b[31mred", "\u202e", "船"),
    *("a" * 300, "b" * 20_000, "/dev/zero", "..", "../../etc/passwd", "os:system"),
    *("builtins:exec", "__class__", "{0}", "%s", "$(id)", "<script>", "[bold]", "NaN"),
    *("1e999", "1", "true", "None", "٣", "1,5", "mariner", "lq", "auto", "calm"),
    *("prime", "2026-01-01T00:00:00Z", "=1+1", "a.b", "#", ";", ",", "1.5.2", "0,5"),
)
INSERTED = (
    *(
        b"\0",
        b"\xff",
        b"\xff\xfe",
        b"\xef\xbb\xbf",
        b"\n",
        b"\r",
        b'"',
        b"{",
        b"[",
        b"}",
    ),
    *(b",", b"\xed\xa0\x80", b"#", b" " * 100, b"9" * 400, b"\\", b"=", b"e"),
)
WHOLE = (
    *(b"", b"\0", b"null", b"[]", b"{}", b"1", b"\xef\xbb\xbf", b"\xff\xfea\0", b"nan"),
    *(b"\0" * 100_000, b"[" * 100_000, b'{"a":' * 5_000, b"a." * 20_000 + b"a=1"),
    *(b"," * 50_000, b"a,b\n" * 20_000, b"PAR1PAR1", b"\x80\x04N.", b"PK\x03\x04"),
)
ENCODINGS = ("utf-16", "utf-8-sig", "utf-32", "cp037")


def mutate(random: Random, name: str, content: bytes) -> bytes:
    """The content of the file of that name with one change."""
    change = CHANGES.get(name.rpartition(".")[2], spoilt)
    too_long = change is toml_changed and len(content) > LARGEST_TOML
    if too_long or random.random() < BYTES_SHARE:
        return spoilt(random, content)
    try:
        return change(random, content)
    except Exception:  # an earlier change left nothing that has the format
        return spoilt(random, content)


def spoilt(random: Random, content: bytes) -> bytes:
    """Bytes cut off, flipped, put in, dropped, doubled; seldom another file."""
    n = len(content)
    start = random.randrange(n + 1)
    end = min(n, start + random.randrange(1, 40))
    piece = content[start:end]
    bit = bytes([content[start] ^ (1 << random.randrange(8))]) if start < n else b""
    digit = str(random.randrange(10)).encode()
    middle = random.choice(
        (bit, bit, random.choice(INSERTED) + piece, b"", piece * 2, piece * 30, digit)
    )
    rest = content[start + 1 :] if middle in (bit, digit) else content[end:]
    return random.choice(
        (*(content[:start] + middle + rest,) * 7, content[:start], random.choice(WHOLE))
    )


def value(random: Random) -> Any:
    """A number, a text, another scalar, or a small, a long or a deep list or table."""
    scalar = random.choice(
        (random.choice(NUMBERS), random.choice(TEXTS), None, True, False)
    )
    if random.random() < 0.75:
        return scalar
    deep: Any = scalar
    for _ in range(random.choice((1, 2, 5, 20, 50))):
        deep = [deep] if random.random() < 0.5 else {"a": deep}
    return random.choice(
        ([scalar] * 2, {"a": scalar}, [0.5] * random.choice((10, 1000)), deep)
    )


def nested_changed(random: Random, root: Any) -> Any:
    """Nested values with one place changed; the rest is shared."""
    if not isinstance(root, dict | list) or not root:
        return scaled(random, root) if random.random() < 0.6 else value(random)
    if isinstance(root, dict):
        name = random.choice(list(root))
        if random.random() < 0.8:
            return root | {name: nested_changed(random, root[name])}
        return in_table(random, root, name)
    place = random.randrange(len(root))
    if random.random() < 0.8:
        return [*root[:place], nested_changed(random, root[place]), *root[place + 1 :]]
    return in_list(random, root, place)


def in_table(random: Random, root: dict[str, Any], key: str) -> dict[str, Any]:
    """A table with an entry dropped, renamed, added, replaced, scaled or emptied."""
    others = {name: one for name, one in root.items() if name != key}
    names = (key.upper(), key + "s", random.choice(TEXTS), random.choice(list(root)))
    return random.choice(
        (
            others,
            others | {random.choice(names): root[key]},
            root | {random.choice(TEXTS): value(random)},
            root | {key: value(random)},
            root | {key: scaled(random, root[key])},
            root | {key: type(root[key])() if root[key] else None},
        )
    )


def in_list(random: Random, root: list[Any], key: int) -> list[Any]:
    """A list with an entry dropped, added, replaced, repeated, or in another order."""
    before, after = root[:key], root[key + 1 :]
    return random.choice(
        (
            before + after,
            [*before, value(random), *root[key:]],
            [*before, value(random), *after],
            [*before, scaled(random, root[key]), *after],
            [*before, *[root[key]] * random.choice((2, 20, 1000)), *after],
            root[::-1],
        )
    )


def scaled(random: Random, one: Any) -> Any:
    """Another number in the place of one, near it or far; another type of the rest."""
    if isinstance(one, bool) or not isinstance(one, int | float):
        return random.choice(
            ([one], {"a": one}, str(one)[:200], random.choice(NUMBERS))
        )
    return one * random.choice((-1, 0, 2, 0.5, 10, 1e3, 1e-3, 1e-6, 1e12, 1e150))


def json_changed(random: Random, content: bytes) -> bytes:
    """A place in JSON, or a key twice."""
    text = json.dumps(nested_changed(random, json.loads(content)))
    if random.random() < 0.05:
        text = text.replace('{"', '{"a": 1, "a": 2, "', 1)
    return text.encode()


def toml_changed(random: Random, content: bytes) -> bytes:
    """A place in TOML."""
    root = nested_changed(random, parse_toml(content.decode(), "seed:"))
    if not isinstance(root, dict):
        return toml(root).encode("utf-8", "surrogatepass")
    lines = [f"{json.dumps(key)} = {toml(one)}\n" for key, one in root.items()]
    return "".join(lines).encode("utf-8", "surrogatepass")


def toml(one: Any) -> str:
    """A value as TOML, tables within a line."""
    if isinstance(one, dict):
        items = (f"{json.dumps(key)} = {toml(inner)}" for key, inner in one.items())
        return "{" + ", ".join(items) + "}"
    if isinstance(one, list):
        return "[" + ", ".join(map(toml, one)) + "]"
    if isinstance(one, str):
        return json.dumps(one, ensure_ascii=False)
    return json.dumps(one) if one is None or isinstance(one, bool) else repr(one)


def csv_changed(random: Random, content: bytes) -> bytes:
    """A cell, a row, a column, the delimiter, quotes, line ends or the encoding."""
    text = content.decode()
    delimiter = ";" if ";" in text.partition("\n")[0] else ","
    rows = [line.split(delimiter) for line in text.split("\n")]
    k = random.randrange(len(rows))
    column = random.randrange(len(rows[0]))
    cell = str(random.choice(NUMBERS + TEXTS))
    what = random.choice(("cell",) * 6 + ("row",) * 3 + ("column",) * 3 + ("text",) * 4)
    if what == "cell":
        rows[k][random.randrange(len(rows[k]))] = cell
    elif what == "row":
        rows[k : k + 1] = random.choice(
            ([], [rows[k]] * 2, [[*rows[k], cell]], [rows[k][:-1]])
        )
    elif what == "column":
        new = random.choice((None, cell, rows[k][0]))
        for row in rows[random.randrange(2) :]:
            row[column : column + 1] = [] if new is None else [new]
    joined = "\n".join(delimiter.join(row) for row in rows)
    if what != "text":
        return joined.encode("utf-8", "surrogatepass")
    place = random.randrange(len(text))
    quoted = text[:place] + random.choice(('"', '""', "'", '"\n')) + text[place:]
    other = text.replace(delimiter, random.choice(";,\t| "))
    commas = text.replace(".", ",")
    ends = text.replace("\n", random.choice(("\r\n", "\r", "\n\n", "\u2028")))
    changed = random.choice((quoted, quoted, other, commas, ends, text))
    return changed.encode(random.choice(ENCODINGS) if changed == text else "utf-8")


def safetensors_changed(random: Random, content: bytes) -> bytes:
    """Its header's length, an entry of the header, its data, or a number of them."""
    (length,) = struct.unpack("<Q", content[:8])
    text, data = content[8 : 8 + length], content[8 + length :]
    what = random.randrange(6)
    if what == 0:
        wrong = random.choice((0, 1, length + 1, 2**31, 2**63, 2**64 - 1, 100_000_000))
        return struct.pack("<Q", wrong) + content[8:]
    if what == 1:
        place = random.randrange(0, len(data), 4)
        bits = struct.pack("<I", random.choice((0x7FC00000, 0x7F800000, 1)))
        return content[: 8 + length + place] + bits + data[place + 4 :]
    if what == 2:
        data = data[: random.randrange(len(data))] + b"\0" * random.choice((0, 4, 1000))
    else:
        text = json.dumps(nested_changed(random, json.loads(text))).encode()
        text += b" " * (-len(text) % 8)
    return struct.pack("<Q", len(text)) + text + data


CHANGES: dict[str, Callable[[Random, bytes], bytes]] = {
    "json": json_changed,
    "toml": toml_changed,
    "csv": csv_changed,
    "safetensors": safetensors_changed,
}
