"""Values that no reader should trip over, and nested values with one place changed."""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Callable
from functools import partial
from random import Random
from typing import Any

Node = Any
Path = tuple[Any, ...]
RAW = "@@raw:"  # begins a text that stands in the file without quotes, such as NaN
_RAW_TEXT = re.compile(rf'"{RAW}([^"\\]*(?:\\.[^"\\]*)*)"')

NUMBERS: tuple[Any, ...] = (
    0,
    -0.0,
    1,
    -1,
    2,
    3,
    0.5,
    1e-9,
    1e-300,
    5e-324,
    1e9,
    1e300,
    1.7976931348623157e308,
    -1e308,
    1e16,
    255,
    256,
    2**31,
    2**32,
    2**53 + 1,
    2**63 - 1,
    2**63,
    -(2**63) - 1,
    2**64,
    10**30,
    f"{RAW}1{'0' * 399}",
    f"{RAW}1{'0' * 5000}",
    f"{RAW}NaN",
    f"{RAW}Infinity",
    f"{RAW}-Infinity",
    f"{RAW}1e999",
    f"{RAW}nan",
    f"{RAW}inf",
    f"{RAW}0x10",
    f"{RAW}01",
    f"{RAW}1_000",
)
TEXTS = (
    "",
    " ",
    "\n",
    "x\ny",
    "\t",
    '"',
    "'",
    '"""',
    "'''",
    '"""\nimport os\n',
    "\\",
    "\\n",
    "\0",
    "a\0b",
    "\ud800",
    "\udfff x",
    "\x1b[31mred",
    "\u202e",
    "é",
    "船",
    "😀",
    "a" * 300,
    "b" * 20_000,
    "/dev/zero",
    "/dev/null",
    "/",
    ".",
    "..",
    "../../etc/passwd",
    "/proc/self/mem",
    "C:\\x",
    "file:///etc/passwd",
    "http://127.0.0.1/",
    "os:system",
    "os",
    "builtins:exec",
    "__class__",
    "__import__('os')",
    "{0}",
    "{name}",
    "%s",
    "%(x)s",
    "$(id)",
    "`id`",
    "<script>",
    "[bold]",
    "[/]",
    "NaN",
    "nan",
    "inf",
    "1e999",
    "1",
    "0",
    "true",
    "null",
    "None",
    "٣",
    "1,5",
    "mariner",
    "lq",
    "pid",
    "auto",
    "calm",
    "rough",
    "grey-box",
    "prime",
    "si",
    "2026-01-01",
    "2026-01-01T00:00:00Z",
    "=1+1",
    "a.b",
    "a[0]",
    "#",
    ";",
    ",",
)


def scalar(random: Random) -> Node:
    """A number, a text, or what is neither."""
    chance = random.random()
    if chance < 0.5:
        return random.choice(NUMBERS)
    if chance < 0.8:
        return random.choice(TEXTS)
    return random.choice((None, True, False))


def node(random: Random) -> Node:
    """Any value, sometimes a table or a list, seldom a deep or a huge one."""
    chance = random.random()
    if chance < 0.7:
        return scalar(random)
    if chance < 0.77:
        return [scalar(random) for _ in range(random.randrange(4))]
    if chance < 0.84:
        return {
            str(random.choice(TEXTS)): scalar(random)
            for _ in range(random.randrange(3))
        }
    if chance < 0.9:
        return [
            [scalar(random) for _ in range(random.randrange(3))]
            for _ in range(random.randrange(3))
        ]
    if chance < 0.94:
        return [0.5] * random.choice((10, 10, 10, 100, 100, 100, 1000, 1000, 10_000))
    return deep(random, scalar(random))


def deep(random: Random, inner: Node) -> Node:
    """A value in many lists or tables."""
    depth = random.choice(
        (2, 2, 5, 5, 18, 19, 20, 21, 50, 900, random.choice((900, 5_000, 100_000)))
    )
    if depth < 60:
        for _ in range(depth):
            inner = [inner] if random.random() < 0.5 else {"a": inner}
        return inner
    pair = random.choice((("[", "]"), ('{"a":', "}"), ("[", "")))
    return f"{RAW}{pair[0] * depth}1{pair[1] * depth}"


def somewhere(random: Random, root: Node) -> Path:
    """A place in nested values, those near the root more often."""
    path: list[Any] = []
    while (
        isinstance(root, dict | list) and root and (not path or random.random() < 0.8)
    ):
        key = (
            random.choice(list(root))
            if isinstance(root, dict)
            else random.randrange(len(root))
        )
        path.append(key)
        root = root[key]
    return tuple(path)


def at(root: Node, path: Path) -> Node:
    """What stands at a place."""
    for key in path:
        root = root[key]
    return root


def changed(root: Node, path: Path, change: Callable[[Node], Node]) -> Node:
    """Nested values with one changed: its surroundings copied, the rest shared."""
    if not path:
        return change(root)
    copy: Node = dict(root) if isinstance(root, dict) else list(root)
    copy[path[0]] = changed(copy[path[0]], path[1:], change)
    return copy


def _without(random: Random, root: Node, path: Path) -> Node:
    def drop(parent: Node) -> Node:
        if isinstance(parent, dict):
            return {key: value for key, value in parent.items() if key != path[-1]}
        return [value for k, value in enumerate(parent) if k != path[-1]]

    return changed(root, path[:-1], drop) if path else {}


def _replaced(random: Random, root: Node, path: Path) -> Node:
    value = node(random)
    return changed(root, path, lambda _: value)


def _retyped(random: Random, root: Node, path: Path) -> Node:
    def other(value: Node) -> Node:
        kinds: list[Node] = [[value], {"a": value}, [[value]], [value, value], None]
        if isinstance(value, dict):
            kinds += [list(value.values()), list(value), list(map(list, value.items()))]
        elif isinstance(value, list):
            kinds += [
                {str(k): one for k, one in enumerate(value)},
                str(value)[:200],
                value[0] if value else 0,
            ]
        elif isinstance(value, str):
            kinds += [
                list(value),
                value.encode().hex(),
                len(value),
                value.upper(),
                value + " ",
                f" {value}",
            ]
        elif value is not None:
            kinds += [
                str(value),
                bool(value),
                int(value) if abs(value) < 1e15 else 0,
                float(value),
            ]
        return random.choice(kinds)

    return changed(root, path, other)


def _number(random: Random, root: Node, path: Path) -> Node:
    """Another number in the place of one, near it or far."""

    def other(value: Node) -> Node:
        if isinstance(value, bool) or not isinstance(value, int | float):
            return random.choice(NUMBERS)
        factors = (-1, 0, 2, 0.5, 10, 0.1, 1e3, 1e-3, 1e6, 1e-6, 1e12, 1e150, 1e-150)
        chosen = random.choice((*factors, None))
        return random.choice(NUMBERS) if chosen is None else value * chosen

    for _ in range(8):  # most places of most files are numbers: look for one
        if isinstance(at(root, path), int | float):
            break
        path = somewhere(random, root)
    return changed(root, path, other)


def _renamed(random: Random, root: Node, path: Path) -> Node:
    def rename(parent: Node) -> Node:
        if not isinstance(parent, dict) or not parent:
            return parent
        old = random.choice(list(parent))
        new = random.choice(
            (
                old.upper(),
                old + "s",
                old[:-1],
                random.choice(TEXTS),
                random.choice(list(parent)),
            )
        )
        return {new if key == old else key: value for key, value in parent.items()}

    return changed(root, path[:-1] if path else path, rename)


def _added(random: Random, root: Node, path: Path) -> Node:
    def add(parent: Node) -> Node:
        value = node(random)
        if isinstance(parent, dict):
            return {**parent, str(random.choice(TEXTS)): value}
        if isinstance(parent, list):
            place = random.randrange(len(parent) + 1)
            return [*parent[:place], value, *parent[place:]]
        return value

    return changed(root, path[:-1] if path else path, add)


def _repeated(random: Random, root: Node, path: Path) -> Node:
    """An entry twice or many times; in a table, its key twice in the text."""

    def repeat(parent: Node) -> Node:
        times = random.choice((2, 2, 2, 3, 20, 1000))
        if isinstance(parent, list):
            return [
                one
                for k, value in enumerate(parent)
                for one in [value] * (times if k == path[-1] else 1)
            ]
        if isinstance(parent, dict):
            return {
                **parent,
                f"{path[-1]}{random.choice((RAW, ' ', '2', '.x'))}": parent[path[-1]],
            }
        return parent

    return changed(root, path[:-1], repeat) if path else root


def _swapped(random: Random, root: Node, path: Path) -> Node:
    other = somewhere(random, root)
    one, two = at(root, path), at(root, other)
    if path[: len(other)] == other or other[: len(path)] == path:
        return changed(
            root, path, lambda _: two
        )  # one within the other: nested in itself
    return changed(changed(root, path, lambda _: two), other, lambda _: one)


def _shuffled(random: Random, root: Node, path: Path) -> Node:
    def shuffle(parent: Node) -> Node:
        if isinstance(parent, dict):
            items = list(parent.items())
            random.shuffle(items)
            return dict(items)
        return (
            random.sample(parent, len(parent)) if isinstance(parent, list) else parent
        )

    return changed(root, path[:-1] if path else path, shuffle)


def _emptied(random: Random, root: Node, path: Path) -> Node:
    def empty(value: Node) -> Node:
        return type(value)() if isinstance(value, dict | list | str) else None

    return changed(root, path[: random.randrange(len(path) + 1)], empty)


def _nested(random: Random, root: Node, path: Path) -> Node:
    return changed(
        root, path, lambda value: deep(random, value if isinstance(value, int) else 1)
    )


#: By name; those that most often reach what lies behind the first check come several
#: times.
CHANGES: tuple[tuple[str, Callable[[Random, Node, Path], Node]], ...] = (
    *(("number", _number),) * 6,
    *(("replace", _replaced),) * 5,
    *(("retype", _retyped),) * 2,
    ("delete", _without),
    ("rename", _renamed),
    ("add", _added),
    ("repeat", _repeated),
    ("swap", _swapped),
    ("shuffle", _shuffled),
    ("empty", _emptied),
    ("nest", _nested),
)


def mutated(random: Random, root: Node) -> tuple[Node, Callable[[], str]]:
    """Nested values with one change, and a function that says what it is."""
    name, change = random.choice(CHANGES)
    path = somewhere(random, root)
    found = change(random, root, path)
    return found, partial(_told, name, path, root, found)


def _told(name: str, path: Path, root: Node, found: Node) -> str:
    place = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path)
    return f"{name} at ${place}: {_short(root, path)} -> {_short(found, path)}"


def _short(root: Node, path: Path) -> str:
    try:
        text = repr(at(root, path))
    except (KeyError, IndexError, TypeError):
        text = "nothing"
    return text if len(text) <= 60 else f"{text[:57]}..."


def json_text(root: Node) -> bytes:
    """Nested values as JSON, raw texts without quotes and the mark taken from keys."""
    text = json.dumps(root)
    if RAW in text:
        text = _RAW_TEXT.sub(_unquoted, text).replace(RAW, "")
    return text.encode()


def _unquoted(found: re.Match[str]) -> str:
    return found[1].replace('\\"', '"')


def toml_text(root: Node) -> bytes:
    """Nested values as TOML: a key a line, tables within a line."""
    if not isinstance(root, dict):
        return _toml(root).encode("utf-8", "surrogatepass")
    lines = [f"{_key(key)} = {_toml(value)}\n" for key, value in root.items()]
    return "".join(lines).encode("utf-8", "surrogatepass")


def _key(key: str) -> str:
    return key.replace(RAW, "") if RAW in key else json.dumps(key, ensure_ascii=False)


def _toml(value: Node) -> str:
    if isinstance(value, dict):
        return (
            "{"
            + ", ".join(f"{_key(key)} = {_toml(one)}" for key, one in value.items())
            + "}"
        )
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, str):
        return (
            value[len(RAW) :]
            if value.startswith(RAW)
            else json.dumps(value, ensure_ascii=False)
        )
    if value is None or isinstance(value, bool):
        return json.dumps(value)
    return repr(value)


def float_bytes(random: Random) -> bytes:
    """A number in single precision that a file of weights should not hold, or might."""
    bits = random.choice(
        (
            0x7FC00000,
            0x7F800000,
            0xFF800000,
            0x7F7FFFFF,
            0x00000001,
            random.getrandbits(32),
        )
    )
    return struct.pack("<I", bits)
