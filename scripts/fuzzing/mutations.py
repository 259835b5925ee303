"""One change to a file, by its format: JSON, TOML, CSV, safetensors, Parquet, bytes."""

from __future__ import annotations

import io
import json
import struct
import warnings
import zipfile
from collections.abc import Callable
from functools import lru_cache
from random import Random
from typing import Any

from fuzzing.values import (
    NUMBERS,
    RAW,
    TEXTS,
    float_bytes,
    json_text,
    mutated,
    toml_text,
)
from shipgym.files import parse_toml

#: The content, and what was done to it, or a function that says so.
Change = tuple[bytes, str | Callable[[], str]]
#: By the ending of a file's name; given at the end of this file.
SOURCES: dict[str, Callable[[Random, bytes], Change]]
LARGEST_TOML = (
    10_000  # bytes that are parsed for a change: keys of many parts take long
)
BYTES_SHARE = 0.12  # of mutations that know nothing of the format
INSERTED = (
    b"\0",
    b"\xff",
    b"\xff\xfe",
    b"\xef\xbb\xbf",
    b"\n",
    b"\r",
    b'"',
    b"'",
    b"{",
    b"[",
    b"}",
    b",",
    b"\xed\xa0\x80",
    b"#",
    b"\x1b",
    b" " * 100,
    b"9" * 400,
    b"\\",
    b"=",
    b"e",
)
WHOLE = (
    b"",
    b"\0",
    b"null",
    b"[]",
    b"{}",
    b"1",
    b'"a"',
    b"\xef\xbb\xbf",
    b"\xff\xfea\0",
    b"\0" * 100_000,
    b"[" * 100_000,
    b'{"a":' * 5_000,
    b"a.b.c" * 8_000 + b"=1",
    b"a." * 20_000 + b"a=1",
    b"," * 50_000,
    b"a,b\n" * 20_000,
    b"\n" * 100_000,
    b"-",
    b"nan",
    b"PAR1PAR1",
    b"\x08\0\0\0\0\0\0\0{}      ",
    b"[[" + b"a" * 50_000 + b"]]",
    b'x="' + b"y" * 200_000 + b'"',
    b"'''",
    b"\x80\x04N.",
    b"PK\x03\x04",
)


def mutate(random: Random, name: str, content: bytes) -> Change:
    """The content of the file of that name with one change."""
    source = SOURCES.get(name.rpartition(".")[2], spoilt)
    if random.random() < BYTES_SHARE or (
        source is toml_changed and len(content) > LARGEST_TOML
    ):
        source = spoilt
    try:
        return source(random, content)
    except Exception:  # of any kind, from any library
        return spoilt(
            random, content
        )  # a change before this one left nothing that has the format


def spoilt(random: Random, content: bytes) -> Change:
    """Bytes cut off, turned, put in, doubled; seldom another file altogether."""
    n = len(content)
    a, b = sorted((random.randrange(n + 1), random.randrange(n + 1)))
    what = random.choice(
        (
            "cut",
            "flip",
            "flip",
            "insert",
            "insert",
            "drop",
            "double",
            "digit",
            "swap",
            "whole",
        )
    )
    if what == "whole":
        k = random.randrange(len(WHOLE))
        return WHOLE[k], f"whole file: {WHOLE[k][:20]!r}..."
    b = min(b, a + 40)
    if what == "cut":
        return content[:a], f"cut at byte {a}"
    if what == "flip" and n:
        place = min(a, n - 1)
        bit = 1 << random.randrange(8)
        return (
            content[:place] + bytes([content[place] ^ bit]) + content[place + 1 :],
            f"bit {bit} of byte {place}",
        )
    if what == "insert":
        piece = random.choice(INSERTED)
        return content[:a] + piece + content[a:], f"{piece[:10]!r} put in at byte {a}"
    if what == "drop":
        return content[:a] + content[b:], f"bytes {a} to {b} dropped"
    if what == "double":
        return (
            content[:b] + content[a:b] * random.choice((1, 1, 30)) + content[b:],
            f"bytes {a} to {b} doubled",
        )
    if what == "digit":
        digit = str(random.randrange(10)).encode()
        return content[:a] + digit + content[a + 1 :], f"byte {a} is {digit!r}"
    return (
        content[:a] + content[a:b][::-1] + content[b:],
        f"bytes {a} to {b} turned round",
    )


@lru_cache(maxsize=256)
def _json(content: bytes) -> Any:
    return json.loads(content)


@lru_cache(maxsize=256)
def _toml(content: bytes) -> Any:
    return parse_toml(content.decode(), "seed:")


def json_changed(random: Random, content: bytes) -> Change:
    """A place in JSON."""
    root, what = mutated(random, _json(content))
    return json_text(root), what


def toml_changed(random: Random, content: bytes) -> Change:
    """A place in TOML."""
    root, what = mutated(random, _toml(content))
    return toml_text(root), what


def csv_changed(random: Random, content: bytes) -> Change:
    """A cell, a row, a column, the delimiter, quotes or the encoding of a table."""
    text = content.decode()
    name, change = random.choice(CSV)
    if name in ENCODINGS:
        return text.encode(name), f"encoded as {name}"
    delimiter = ";" if ";" in text.partition("\n")[0] else ","
    rows = [line.split(delimiter) for line in text.split("\n")]
    changed = change(random, rows, delimiter)
    return changed.encode("utf-8", "surrogatepass"), name


def _cell(random: Random) -> str:
    if random.random() < 0.6:
        return str(random.choice(NUMBERS)).removeprefix(RAW)
    return random.choice(
        (
            *TEXTS,
            "-",
            "1.5.2",
            "1e",
            "--1",
            "0,5",
            "1 000",
            '"1"',
            '"',
            '""',
            "N/A",
            "#N/A",
        )
    )


def _joined(rows: list[list[str]], delimiter: str) -> str:
    return "\n".join(delimiter.join(row) for row in rows)


def _one_cell(random: Random, rows: list[list[str]], delimiter: str) -> str:
    row = random.choice(rows)
    row[random.randrange(len(row))] = _cell(random)
    return _joined(rows, delimiter)


def _one_column(random: Random, rows: list[list[str]], delimiter: str) -> str:
    k, cell = random.randrange(len(rows[0])), _cell(random)
    for row in rows[random.randrange(2) :]:
        if k < len(row):
            row[k] = cell
    return _joined(rows, delimiter)


def _one_row(random: Random, rows: list[list[str]], delimiter: str) -> str:
    k = random.randrange(len(rows))
    what = random.randrange(6)
    if what == 0:
        del rows[k]
    elif what == 1:
        rows.insert(k, list(rows[random.randrange(len(rows))]))
    elif what == 2:
        rows[k].append(_cell(random))
    elif what == 3:
        rows[k].pop()
    elif what == 4:
        rows[:] = rows[:1] + random.sample(rows[1:], len(rows) - 1)
    else:
        rows[:] = rows[: random.randrange(1, 5)]
    return _joined(rows, delimiter)


def _columns(random: Random, rows: list[list[str]], delimiter: str) -> str:
    """A column dropped, twice, renamed, or many of them."""
    k, what = random.randrange(len(rows[0])), random.randrange(5)
    if what == 4:
        many = random.choice((10, 200, 2000))
        wide = [
            row + [f"c{i}" if j == 0 else "1" for i in range(many)]
            for j, row in enumerate(rows[:4])
        ]
        return _joined(wide, delimiter)
    for j, row in enumerate(rows):
        if k >= len(row):
            continue
        if what == 0:
            del row[k]
        elif what == 1:
            row.append(row[k])
        elif j == 0:
            row[k] = (
                random.choice((row[k].upper(), f'"{row[k]}"', *TEXTS[:40]))
                if what == 2
                else rows[0][k - 1]
            )
    return _joined(rows, delimiter)


def _delimited(random: Random, rows: list[list[str]], delimiter: str) -> str:
    """Another delimiter, in all lines or in one."""
    other = random.choice(";,\t| :")
    if random.random() < 0.5:
        return _joined(rows, other)
    k = random.randrange(len(rows))
    return "\n".join(
        (other if j == k else delimiter).join(row) for j, row in enumerate(rows)
    )


def _quoted(random: Random, rows: list[list[str]], delimiter: str) -> str:
    """Quotes around cells, or one that is not closed."""
    text = _joined(rows, random.choice((delimiter, delimiter, "\t")))
    place = random.randrange(len(text) + 1)
    quote = random.choice(('"', '"', '""', "'", '"\n', '",'))
    return text[:place] + quote + text[place:]


def _decimal_commas(random: Random, rows: list[list[str]], delimiter: str) -> str:
    return _joined(rows, random.choice((delimiter, ";", "\t"))).replace(".", ",")


def _line_ends(random: Random, rows: list[list[str]], delimiter: str) -> str:
    return _joined(rows, delimiter).replace(
        "\n", random.choice(("\r\n", "\r", "\n\n", "\n\r", "\x85", "\u2028", "\x0b"))
    )


ENCODINGS = ("utf-16", "utf-8-sig", "utf-16-le", "utf-32", "cp037")
_Rows = Callable[[Random, list[list[str]], str], str]
CSV: tuple[tuple[str, _Rows], ...] = (
    *(("a cell", _one_cell),) * 8,
    ("a column's cells", _one_column),
    *(("a row", _one_row),) * 3,
    *(("columns", _columns),) * 2,
    ("delimiter", _delimited),
    *(("quote", _quoted),) * 3,
    ("decimal commas", _decimal_commas),
    ("line ends", _line_ends),
    *((name, _one_cell) for name in ENCODINGS),
)

DTYPES = (
    "F8_E4M3",
    "F8_E5M2",
    "F8_E8M0",
    "F4",
    "F6_E2M3",
    "BF16",
    "F16",
    "F32",
    "F64",
    "I8",
    "I16",
    "I32",
    "I64",
    "U8",
    "U16",
    "U32",
    "U64",
    "BOOL",
    "C64",
    "f32",
    "",
)


def safetensors_changed(random: Random, content: bytes) -> Change:
    """Change the header's length, an entry of it, or a number of the data."""
    (length,) = struct.unpack("<Q", content[:8])
    header, data = _json(content[8 : 8 + length]), content[8 + length :]
    said: str | Callable[[], str]
    what = random.randrange(8)
    if what == 0:
        wrong = random.choice(
            (
                0,
                1,
                length - 1,
                length + 1,
                len(content),
                2**31,
                2**63,
                2**64 - 1,
                100_000_000,
            )
        )
        return struct.pack("<Q", wrong) + content[8:], f"header of {wrong} bytes"
    if what == 1 and data:
        place = random.randrange(len(data)) // 4 * 4
        return (
            content[: 8 + length + place] + float_bytes(random) + data[place + 4 :],
            f"number at byte {place}",
        )
    if what == 2:
        data, said = (
            data[: random.randrange(len(data) + 1)]
            + b"\0" * random.choice((0, 4, 1000)),
            "data of other length",
        )
    elif what <= 5:
        name = random.choice([key for key in header if key != "__metadata__"])
        field = random.choice(("dtype", "shape", "data_offsets"))
        value = (
            random.choice(DTYPES)
            if field == "dtype"
            else _counts(random, header[name][field])
        )
        header, said = (
            {**header, name: {**header[name], field: value}},
            f"{name}.{field} is {value}",
        )
    else:
        header, said = mutated(random, header)
        if (
            "__metadata__" in header
            and isinstance(header["__metadata__"], dict)
            and random.random() < 0.6
        ):
            header, said = _metadata(random, header)
    text = json_text(header)
    text += b" " * (-len(text) % 8)
    return struct.pack("<Q", len(text)) + text + data, said


def _counts(random: Random, old: list[int]) -> Any:
    """Other lengths or offsets."""
    what = random.randrange(6)
    if what == 0:
        return old[::-1]
    if what == 1:
        return [*old, random.choice((1, 0, 2**40))]
    if what == 2:
        return old[:-1]
    if what == 3:
        return [random.choice((0, -1, 2**32, 2**63, 2**64, 1, 0.5, "1")), *old[1:]]
    return [number + random.choice((-4, -1, 0, 1, 4)) for number in old]


def _metadata(random: Random, header: Any) -> tuple[Any, Callable[[], str]]:
    """A change in the JSON text that a checkpoint keeps in its metadata."""
    name = random.choice(list(header["__metadata__"]))
    root, said = mutated(random, _json(header["__metadata__"][name].encode()))
    text = json_text(root).decode("utf-8", "surrogatepass")
    return {**header, "__metadata__": {**header["__metadata__"], name: text}}, said


def parquet_changed(random: Random, content: bytes) -> Change:
    """Drop, rename, retype, resize or change a column; or change bytes."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    if random.random() < 0.5:
        return spoilt(random, content)
    table = pq.read_table(io.BytesIO(content))
    k = random.randrange(table.num_columns)
    name, values = table.column_names[k], table.column(k)
    n = table.num_rows
    others: dict[str, Callable[[], Any]] = {
        "texts": lambda: pa.array([random.choice(TEXTS[:8]) for _ in range(n)]),
        "binary": lambda: pa.array([b"\xff\xfe"] * n, pa.binary()),
        "broken UTF-8": (
            lambda: pa.array([b"\xff\xfe"] * n, pa.binary()).view(pa.string())
        ),
        "nulls": lambda: pa.nulls(n, values.type),
        "null type": lambda: pa.nulls(n),
        "lists": lambda: pa.array([[1.0, 2.0]] * n),
        "structs": lambda: pa.array([{"a": 1}] * n),
        "dates": lambda: pa.array([0] * n, pa.timestamp("s")),
        "dictionary": lambda: pa.array(["a"] * n).dictionary_encode(),
        "decimals": lambda: pa.array([1] * n, pa.decimal128(30, 2)),
        "huge": lambda: pa.array([1.7e308] * n),
        "infinite": lambda: pa.array([float("inf")] * n),
        "large numbers": lambda: pa.array([2**63 + 5] * n, pa.uint64()),
        "truth": lambda: pa.array([True] * n),
        "halves": lambda: pa.array([0.5] * n),
        "other rows": lambda: values.take(
            pa.array([random.randrange(n) for _ in range(n)])
        ),
    }
    what = random.choice((*others, "drop", "rename", "twice", "rows", "empty"))
    if what == "drop":
        table = table.remove_column(k)
    elif what == "rename":
        table = table.rename_columns(
            [
                random.choice(TEXTS[:12]) if one == name else one
                for one in table.column_names
            ]
        )
    elif what == "twice":
        table = table.append_column(name, values)
    elif what in ("rows", "empty"):
        table = (
            table.slice(0, random.randrange(n)) if what == "rows" else table.slice(0, 0)
        )
    else:
        table = table.set_column(k, name, others[what]())
    sink = io.BytesIO()
    pq.write_table(table, sink)
    return sink.getvalue(), f"column {name}: {what}"


def zip_changed(random: Random, content: bytes) -> Change:
    """Change one member, which is JSON, a zip or bytes, or the set of members."""
    with zipfile.ZipFile(io.BytesIO(content)) as file:
        members: list[list[Any]] = [
            [one.filename, file.read(one)] for one in file.infolist()
        ]
    k = random.randrange(len(members))
    name, inner = members[k]
    what = random.randrange(12)
    said: str | Callable[[], str] = f"member {name} dropped"
    if what == 0:
        del members[k]
    elif what == 1:
        members[k][0], said = (
            random.choice(members)[0] + random.choice(("", "x", "/")),
            f"member {name} renamed",
        )
    else:
        change = (
            zip_changed
            if inner[:2] == b"PK"
            else json_changed
            if inner[:1] == b"{"
            else spoilt
        )
        members[k][1], said = change(random, inner)
    sink = io.BytesIO()
    kind = zipfile.ZIP_DEFLATED if what == 2 else zipfile.ZIP_STORED
    with (
        warnings.catch_warnings(action="ignore"),
        zipfile.ZipFile(sink, "w", kind) as file,
    ):  # of names twice
        for name, inner in members:
            file.writestr(name, inner)
    return sink.getvalue(), said


SOURCES = {
    "json": json_changed,
    "toml": toml_changed,
    "csv": csv_changed,
    "safetensors": safetensors_changed,
    "parquet": parquet_changed,
    "zip": zip_changed,
}
