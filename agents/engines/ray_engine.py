"""Jobs on a ray cluster, or on ray started on this computer."""

import os
import socket
import subprocess
import sys
import warnings
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from agents.engines.job import (
    ONE_THREAD,
    JobFunction,
    Outcome,
    died_too_often,
    do_job,
    environment,
)
from shipgym.errors import InputError

PATIENCE_S = 10.0  # for an address to answer
RAY_PATIENCE_S = 30.0  # for ray to be imported and to connect
#: Run in a child: where something else than ray answers, ray's client waits for minutes
#: or ends the process.
CONNECT = (
    "import ray, sys; ray.init(sys.argv[1], log_to_driver=False,"
    " configure_logging=False)"
)


class EngineError(InputError):
    """Ray is not installed, or not there: whatever the jobs are, they cannot be done."""


def on_ray(
    function: JobFunction,
    texts: list[str],
    workers: int | None,
    address: str | None,
    retries: int,
) -> Iterator[Outcome]:
    """Do jobs on ray: see `agents.engines.jobs.run_jobs`.

    Raises EngineError if ray is not installed, or there is no cluster at the address;
    WorkerDiedError if the worker of a job dies more often than `retries`.
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
                except (
                    ray.exceptions.WorkerCrashedError,
                    ray.exceptions.OutOfMemoryError,
                ):
                    raise died_too_often(text, retries) from None
                yield outcome
        finally:
            for reference in doing:
                ray.cancel(reference, force=True)


@contextmanager
def _connected(workers: int | None, address: str | None) -> Iterator[Any]:
    """Ray, connected; what was started here is ended here."""
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # it would ask the network
    os.environ.setdefault(
        "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0"
    )  # its coming default; it would warn
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            import ray
        except ImportError:
            raise EngineError(
                "engine: 'ray' found, but it is not installed: pip install"
                " 'shipgym[ray]', or take 'local'"
            ) from None
        if ray.is_initialized():
            yield ray
            return
        where: dict[str, Any] = {
            "address": "local",
            "num_cpus": workers,
            "include_dashboard": False,
        }
        if address is not None:
            check_answers(address)
            where = {"address": address}
        try:
            with environment(
                PYTHONPATH=os.pathsep.join(filter(None, sys.path)), **ONE_THREAD
            ):
                ray.init(**where, log_to_driver=False, configure_logging=False)
        except Exception as error:
            raise EngineError(
                f"engine: 'ray' found, but it does not start here: {error}"
            ) from None
    try:
        yield ray
    finally:
        ray.shutdown()


def check_answers(address: str, ray_patience_s: float = RAY_PATIENCE_S) -> None:
    """Refuse an address at which no ray cluster answers.

    `address`: host and port, with ``ray://`` for a client's; or ``"auto"``;
    `ray_patience_s`: how long to wait for ray to connect, s. Raises EngineError naming
    what is wrong with the address, or what ray says.
    """
    if address != "auto":
        host, _, port = address.removeprefix("ray://").rpartition(":")
        if not host or not port.isdigit() or not 0 < int(port) < 65536:
            raise EngineError(
                f"address: '{address}' found, expected 'HOST:PORT', 'ray://HOST:PORT'"
                " or 'auto'; the port of a cluster is 6379 unless it was started with"
                " another, that of its client server 10001"
            )
        try:
            socket.create_connection(
                (host.strip("[]"), int(port)), timeout=PATIENCE_S
            ).close()
        except OSError as error:
            raise _no_cluster(
                address, PATIENCE_S, error.strerror or str(error)
            ) from None
    command = [sys.executable, "-c", CONNECT, address]
    try:
        subprocess.run(
            command, check=True, capture_output=True, text=True, timeout=ray_patience_s
        )
    except subprocess.TimeoutExpired:
        raise _no_cluster(
            address, ray_patience_s, "no answer that ray understands"
        ) from None
    except subprocess.CalledProcessError as error:
        said = error.stderr.strip().splitlines() or [f"exit code {error.returncode}"]
        raise _no_cluster(address, ray_patience_s, said[-1]) from None


def _no_cluster(address: str, patience_s: float, reason: str) -> EngineError:
    return EngineError(
        f"address: no ray cluster answers at '{address}' within {patience_s:g} s"
        f" ({reason}). Is it the right port? A cluster with a token (`ray"
        " get-auth-token`) wants RAY_AUTH_MODE=token and the same token here. Start a"
        " cluster by `ray start --head`, or leave the address out to run on this"
        " computer"
    )
