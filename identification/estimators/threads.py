"""One thread for linear algebra on tall, narrow matrices, which gain by no more."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

from threadpoolctl import ThreadpoolController  # type: ignore[import-untyped]


@contextmanager
def single_threaded() -> Iterator[None]:
    """Context, and decorator, in which the linear algebra libraries use one thread.

    A singular value decomposition of 6000 x 15 takes 4 ms so, and up to 160 ms on two
    busy cores.
    """
    with _controller().limit(limits=1, user_api="blas"):
        yield


@cache
def _controller() -> ThreadpoolController:
    # looks through the loaded libraries, which takes 20 ms
    return ThreadpoolController()
