"""Jobs on a ray cluster, or on ray started on this machine."""

from __future__ import annotations

import os
import socket
import sys
import threading
import warnings
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from agents.engines.jobs import ONE_THREAD, Done, JobFunction, died_too_often, do_job, environment
from shipgym.errors import InputError

PATIENCE_S = 10.0
# HTTP/2: a server of gRPC answers every call with status 200, what went wrong is in headers of its own
GREETING = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
FRAME_HEAD, LARGEST_FRAME, FRAMES_READ = 9, 16384, 20
HEADERS, SETTINGS, ALL_SENT = 1, 4, 5
POST_HTTP, PATH, AUTHORITY, CONTENT_TYPE = b"\x83\x86", b"\x04", b"\x01", b"\x0f\x10"
STATUS_200 = b"\x88"


def on_ray(
    function: JobFunction,
    texts: list[str],
    workers: int | None,
    address: str | None,
    retries: int,
    done: Done,
) -> None:
    """Do jobs on ray: see `agents.engines.jobs.run_jobs`.

    Raises
    ------
    InputError
        If ray is not installed, or there is no cluster at the address.
    WorkerDiedError
        If the worker of a job dies more often than `retries`.
    """
    with _connected(workers, address) as ray:
        at_once = workers or max(1, int(ray.cluster_resources().get("CPU", 1)))
        task = ray.remote(num_cpus=1, max_retries=retries)(do_job)
        waiting = deque(texts)
        doing: dict[Any, str] = {}
        try:
            while waiting or doing:
                while waiting and len(doing) < at_once:
                    text = waiting.popleft()
                    doing[task.remote(function, text)] = text
                ready = ray.wait(list(doing), num_returns=1)[0][0]
                text = doing.pop(ready)
                try:
                    outcome = ray.get(ready)
                except (ray.exceptions.WorkerCrashedError, ray.exceptions.OutOfMemoryError):
                    raise died_too_often(text, retries) from None
                done(text, outcome)
        except BaseException:
            for reference in doing:
                ray.cancel(reference, force=True)
            raise


@contextmanager
def _connected(workers: int | None, address: str | None) -> Iterator[Any]:
    """Ray, connected; what was started here is ended here."""
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # it would ask the network
    os.environ.setdefault(
        "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0"
    )  # as ray will have it, without its warning
    if address is not None:
        os.environ.setdefault("RAY_NUM_REDIS_GET_RETRIES", "8")  # seconds for a cluster; read on import
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            import ray
        except ImportError:
            raise InputError(
                "engine: 'ray' found, but it is not installed: pip install 'shipgym[ray]', or take 'local'"
            ) from None
        if ray.is_initialized():
            yield ray
            return
        if address is None:
            where: dict[str, Any] = {"address": "local", "num_cpus": workers, "include_dashboard": False}
        else:
            check_answers(address)
            where = {"address": address}
        try:
            with environment(PYTHONPATH=os.pathsep.join(filter(None, sys.path)), **ONE_THREAD):
                ray.init(**where, log_to_driver=False, configure_logging=False)
        except Exception as error:
            if address is None:
                raise InputError(f"engine: 'ray' found, but it does not start here: {error}") from None
            raise InputError(
                f"address: '{address}' found, but ray refuses: {error}; a cluster with a token (`ray "
                f"get-auth-token`) wants RAY_AUTH_MODE=token and the same token here"
            ) from None
    try:
        yield ray
    finally:
        ray.shutdown()


def check_answers(address: str, patience_s: float = PATIENCE_S) -> None:
    """Refuse an address at which no ray answers: its client would wait for a minute, or end this process.

    Parameters
    ----------
    address : str
        Host and port, with ``ray://`` for a client's; ``"auto"`` is left to ray, which knows by its files.
    patience_s : float
        How long to wait, s.

    Raises
    ------
    InputError
        Naming what is wrong with the address or what was heard there.
    """
    if address == "auto":
        return
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if not host or not port.isdigit() or not 0 < int(port) < 65536:
        raise InputError(
            f"address: '{address}' found, expected 'HOST:PORT', 'ray://HOST:PORT' or 'auto'; the port of a "
            f"cluster is 6379 unless it was started with another, that of its client server 10001"
        )
    heard: list[bool | OSError] = []
    asking = threading.Thread(
        target=lambda: heard.append(_ask(host.strip("[]"), int(port), patience_s)), daemon=True
    )
    asking.start()
    asking.join(patience_s)  # names are looked up and several addresses tried without a limit of their own
    answer = heard[0] if heard else TimeoutError()
    if isinstance(answer, OSError):
        reason = "no answer" if isinstance(answer, TimeoutError) else answer.strerror or str(answer)
        raise InputError(
            f"address: no ray cluster answers at '{address}' within {patience_s:g} s ({reason}); start one "
            f"by `ray start --head`, or leave the address out to run on this machine"
        )
    if not answer and os.environ.get("RAY_USE_TLS", "0") != "1":
        raise InputError(f"address: what answers at '{address}' is not ray; is it the right port?")


def _ask(host: str, port: int, patience_s: float) -> bool | OSError:
    """Whether a server of gRPC, which ray speaks, answers there."""
    try:
        with socket.create_connection((host, port), timeout=patience_s) as connection:
            connection.sendall(_question())
            for _ in range(FRAMES_READ):
                head = connection.recv(FRAME_HEAD, socket.MSG_WAITALL)
                if len(head) < FRAME_HEAD:
                    break
                content = connection.recv(min(int.from_bytes(head[:3]), LARGEST_FRAME), socket.MSG_WAITALL)
                if head[3] == HEADERS:
                    return STATUS_200 in content[:8]
    except OSError as error:
        return error
    return False


def _question() -> bytes:
    """A call in HTTP/2: greeting, settings that change nothing, headers (RFC 9113, section 6; RFC 7541)."""
    headers = POST_HTTP + b"".join(
        name + bytes([len(value)]) + value
        for name, value in (
            (PATH, b"/grpc.health.v1.Health/Check"),
            (AUTHORITY, b"ray"),
            (CONTENT_TYPE, b"application/grpc"),
            (b"\x00\x02te", b"trailers"),
        )
    )
    return GREETING + _frame(SETTINGS, 0, 0, b"") + _frame(HEADERS, ALL_SENT, 1, headers)


def _frame(kind: int, flags: int, stream: int, content: bytes) -> bytes:
    return len(content).to_bytes(3) + bytes([kind, flags]) + stream.to_bytes(4) + content
