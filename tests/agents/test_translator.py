"""Each construct of Python is the same in C, or refused with its line."""

import ctypes
import math
from typing import NamedTuple

import numpy as np
import pytest

from agents.export.c_syntax import c_name, literal
from agents.export.source import render
from agents.export.translator import Translator
from shipgym.engine import mathematics
from shipgym.errors import InputError
from tests.agents.compiling import built

LIMIT, EXACT = 3, True


def compiled(folder, functions):
    """Functions of one number, written as C and compiled."""
    c = Translator({}, "it")
    lines = []
    for k, function in enumerate(functions):
        name = c.function(function, 0.0).name
        head = f"double f{k}(double x)"
        lines += [f"{head};", f"{head} {{ return {name}(x); }}"]
    body = [*c.structures.texts, *c.functions, *lines]
    text = render("prelude.c.j2", "it", body="\n".join(body))
    library = built(folder, "it", "", text)
    found = []
    for k in range(len(functions)):
        in_c = getattr(library, f"f{k}")
        in_c.restype, in_c.argtypes = ctypes.c_double, [ctypes.c_double]
        found.append(in_c)
    return found


@pytest.mark.parametrize("function", ["exponential", "two_to", "wrap", "arctan"])
def test_functions_of_the_engine_are_the_same_in_c_bit_by_bit(function, tmp_path):
    plain = getattr(mathematics, function)
    (in_c,) = compiled(tmp_path, [plain])
    largest = 0.0 if function == "two_to" else 9.0
    for x in np.linspace(-9.0, largest, 37).tolist():
        assert in_c(x) == plain(x)


class Pair(NamedTuple):
    """Two numbers."""

    left: float
    right: float


class Nested(NamedTuple):
    """A number and a pair."""

    first: float
    pair: Pair


def within(x):
    return 1 if -1.0 < x <= 2.0 else 0.25


def either(x):
    outside = x > 1.0 or (x < -1.0 and x != -3.0)
    return 0.5 if not outside else -x


def summed(x):
    total = 0.0
    for k in range(LIMIT + 1):
        total = total + x * (k + 1) / 2 - k / 2
    return total


def swapped(x):
    a, b = x, 2.0
    a, b = b, a
    return a - b * 3.0 - (a - 1)


def bracketed(x):
    return x - (x + 2.0) - -x / (x * (3.0 / (x + 10.0)) + 7.0) + (x + (x + 1e-3))


def powers(x):
    return (1.0 + x * x) ** 0.5 + x**3 + (1.0 + x * x) ** -1 + (2.0 + x) ** 0


def branches(x):
    y = (x - 1.0) if EXACT else unwritable(x)
    unread = turned(Pair(y, y))
    if not EXACT:
        y = unwritable(unread)
    if y > 0.0:
        y = y / 4
        z = y - 1.0
    else:
        z = -(y + 1)
    return y + 2.0 * z


def limited(x):
    whole = float(int(x)) / 2 + math.floor(x)
    return abs(min(x, 0.5)) + max(-x, whole) + np.arctan2(x, 1.5)


def of_arrays(x):
    """What NumPy does with arrays too."""
    chosen = np.where((x > 0.0) & (np.abs(x) < 2.0), np.clip(x, -0.5, 0.7), np.sign(x))
    angle = np.mod(3.0 * x + np.pi, 2.0 * np.pi) - np.pi
    return chosen + 2.0 * np.maximum(angle, np.hypot(x, 1.0)) - np.minimum(x, 0.1)


def paired(x):
    pair = Pair(x, right=2.0)
    left, right = turned(pair)
    return left / right


def turned(pair):
    return pair.right, pair.left + 9.0


def replaced(x):
    nested = Nested(x, Pair(1.0, x))
    other = nested._replace(first=2.0, pair=nested.pair._replace(left=x * x))
    return other.first * other.pair.left - other.pair.right


def by_another(x):
    return applied(x, within) + applied(x, either)


def applied(x, function):
    return function(x + 0.3)


def named_as_in_c(x):
    sign = np.sign(x)
    exp = np.exp(-abs(x))
    clip = np.clip(x, -exp, exp)
    fabs, rest = abs(sign), 3
    return sign + exp * clip + fabs + rest


PLAIN = [
    named_as_in_c,
    within,
    either,
    summed,
    swapped,
    bracketed,
    powers,
    branches,
    limited,
    of_arrays,
    paired,
    replaced,
    by_another,
]


def test_each_construct_of_python_is_the_same_in_c(tmp_path):
    for in_c, plain in zip(compiled(tmp_path, PLAIN), PLAIN, strict=True):
        for x in (-3.0, -1.3, -1.0, -0.4, 0.0, 0.3, 0.7, 1.0, 1.9, 2.0, 2.6):
            expected = pytest.approx(plain(x), rel=1e-15, abs=1e-15)
            assert in_c(x) == expected, (plain.__name__, x)


def unwritable(x):
    """What C has no word for."""
    return np.sinc(x)


def of_a_sequence(x):
    total = 0.0
    for one in x:
        total = total + one
    return total


def of_a_condition(x):
    while x > 0.0:
        x = x - 1.0
    return x


def of_too_few(x):
    return unwritable()


def of_itself(x):
    return of_itself(x - 1.0)


def of_a_text(x):
    return "x"


def of_numbers_as_flags(x):
    return (x > 0.0) & x


@pytest.mark.parametrize(
    ("function", "line", "said"),
    [
        (unwritable, 3, "np.sinc"),
        (of_a_condition, 2, "x > 0.0"),
        (of_a_sequence, 3, "for one in x"),
        (of_too_few, 2, "unwritable"),
        (of_itself, 2, "of_itself"),
        (of_a_text, 1, "'x'"),
        (of_numbers_as_flags, 2, "x > 0.0"),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_what_c_has_no_words_for_is_refused_with_its_line(function, line, said):
    with pytest.raises(InputError) as refused:
        Translator({}, "it").function(function, 0.0)
    message = str(refused.value)
    assert "cannot be written as C" in message
    assert said in message
    assert message.startswith(f"{__name__}.{function.__name__}, line {line}: ")


def wrap(x):
    return x


def test_numbers_and_names_are_those_of_c():
    numbers = {0.1: "0.1", -2.0: "(-2.0)", 3: "3.0", True: "true", 1e300: "1e+300"}
    numbers |= {math.inf: "HUGE_VAL", -math.inf: "(-HUGE_VAL)"}
    assert {number: literal(number) for number in numbers} == numbers
    assert literal(math.nan) == "NAN"
    assert [c_name(name) for name in ("double", "heading")] == ["double_", "heading"]
    with pytest.raises(InputError, match="name: expected ASCII letters"):
        c_name("é")
