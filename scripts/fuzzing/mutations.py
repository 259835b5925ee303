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
#: Bytes put in: controls, broken and wide characters, signs of the formats.
INSERTED = b'\0 \xff \xff\xfe \xef\xbb\xbf \n \r " { [ } , \xed\xa0\x80 # \\ = e'.split(
    b" "
)
WHOLE = (
    *(b"", b"\0", b"null", b"[]", b"{}", b"1", b"\xef\xbb\xbf", b"\xff\xfea\0", b"nan"),
    *(b"\0" * 100_000, b"[" * 100_000, b'{"a":' * 5_000, b"a." * 20_000 + b"a=1"),
    *(b"," * 50_000, b"a,b\n" * 20_000, b"PAR1PAR1", b"\x80\x04N.", b"PK\x03\x04"),
)
ENCODINGS = ("utf-16", "utf-8-sig", "utf-32", "cp037")
FACTORS = (-1, 0, 2, 0.5, 10, 1e3, 1e-3, 1e-6, 1e12, 1e150)


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
    """Bytes flipped, put in, dropped or doubled; cut off; seldom another file."""
    start = random.randrange(len(content) + 1)
    head, piece, tail = (
        content[:start],
        content[start : start + 40],
        content[start + 40 :],
    )
    flipped = bytes(byte ^ (1 << random.randrange(8)) for byte in piece[:1])
    middle = random.choice(
        (
            flipped + piece[1:],
            random.choice(INSERTED) + piece,
            b"",
            piece * 2,
            piece * 30,
        )
    )
    return random.choice((*(head + middle + tail,) * 7, head, random.choice(WHOLE)))


def value(random: Random) -> Any:
    """A number, a text, another scalar, or a list or table, small, long or deep."""
    scalar = random.choice(
        (random.choice(NUMBERS), random.choice(TEXTS), None, True, False)
    )
    if random.random() < 0.75:
        return scalar
    deep: Any = scalar
    for _ in range(random.choice((1, 2, 5, 20, 50))):
        deep = random.choice(([deep], {"a": deep}))
    return random.choice(([scalar] * 2, [0.5] * random.choice((10, 1000)), deep))


def changed(random: Random, root: Any) -> Any:
    """Nested values with one place changed; the rest is shared."""
    if not isinstance(root, dict | list):
        number = isinstance(root, int | float) and random.random() < 0.6
        return root * random.choice(FACTORS) if number else value(random)
    if not root or random.random() < 0.1:
        return value(random)
    if isinstance(root, list):
        k = random.randrange(len(root))
        inner = changed(random, root[k])
        piece = random.choice(
            (*([inner],) * 6, [], [value(random), root[k]], [root[k]] * 1000)
        )
        return root[:k] + piece + root[k + 1 :]
    name = random.choice(list(root))
    rest = {key: one for key, one in root.items() if key != name}
    other = random.choice((name.upper(), name + "s", *TEXTS, *root))
    return random.choice(
        (
            *(root | {name: changed(random, root[name])},) * 8,
            rest,
            rest | {other: root[name]},
            root | {other: value(random)},
        )
    )


def json_changed(random: Random, content: bytes) -> bytes:
    """A place in JSON, or a key twice."""
    text = json.dumps(changed(random, json.loads(content)))
    if random.random() < 0.05:
        text = text.replace('{"', '{"a": 1, "a": 2, "', 1)
    return text.encode()


def toml_changed(random: Random, content: bytes) -> bytes:
    """A place in TOML."""
    root = changed(random, parse_toml(content.decode(), "seed:"))
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
    """A cell, a row, a column, or the delimiter, quotes, line ends or the encoding."""
    text = content.decode()
    delimiter = ";" if ";" in text.partition("\n")[0] else ","
    if random.random() < 0.25:
        return reworded(random, text, delimiter)
    rows = [line.split(delimiter) for line in text.split("\n")]
    k = random.randrange(len(rows))
    column = random.randrange(len(rows[0]))
    cell = str(random.choice(NUMBERS + TEXTS))
    what = random.choice(("cell", "cell", "row", "column"))
    if what == "cell":
        rows[k][column : column + 1] = [cell]
    elif what == "row":
        rows[k : k + 1] = random.choice(([], [rows[k]] * 2, [[*rows[k], cell]]))
    else:
        new = random.choice(([], [cell], [rows[k][0]]))
        for row in rows[random.randrange(2) :]:
            row[column : column + 1] = new
    joined = "\n".join(delimiter.join(row) for row in rows)
    return joined.encode("utf-8", "surrogatepass")


def reworded(random: Random, text: str, delimiter: str) -> bytes:
    """The same table in another dialect or encoding, or with a stray quote."""
    place = random.randrange(len(text))
    quote = random.choice(('"', '""', "'", '"\n'))
    dialects = (
        text[:place] + quote + text[place:],
        text.replace(delimiter, random.choice(";,\t| ")),
        text.replace(".", ","),
        text.replace("\n", random.choice(("\r\n", "\r", "\n\n", "\u2028"))),
    )
    if random.random() < 0.2:
        return text.encode(random.choice(ENCODINGS))
    return random.choice(dialects).encode()


def safetensors_changed(random: Random, content: bytes) -> bytes:
    """Its header's length, an entry of the header, or its data."""
    (length,) = struct.unpack("<Q", content[:8])
    text, data = content[8 : 8 + length], content[8 + length :]
    what = random.randrange(5)
    if what == 0:
        length = random.choice((0, 1, length + 1, 2**31, 2**63, 2**64 - 1))
    elif what == 1:
        place = random.randrange(0, len(data), 4)
        bits = struct.pack("<I", random.choice((0x7FC00000, 0x7F800000, 1)))
        data = data[:place] + bits + data[place + 4 :]
    elif what == 2:
        data = data[: random.randrange(len(data))] + b"\0" * random.choice((0, 4, 1000))
    else:
        text = json.dumps(changed(random, json.loads(text))).encode()
        text += b" " * (-len(text) % 8)
        length = len(text)
    return struct.pack("<Q", length) + text + data


CHANGES: dict[str, Callable[[Random, bytes], bytes]] = {
    "json": json_changed,
    "toml": toml_changed,
    "csv": csv_changed,
    "safetensors": safetensors_changed,
}
