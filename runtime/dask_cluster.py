"""A Dask cluster that is already there: reached, and known to have the same code as here, before any work goes out."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from .distribution import install_hint
from .errors import InputError

if TYPE_CHECKING:
    from distributed import Client

#: Tasks that wait at each thread of the cluster, so that none is idle while a result travels.
AHEAD = 2
PATIENCE_S = 20.0
_ADDRESS = re.compile(r"inproc://\S+|(\w+://)?\S+:\d+/?")


def connected(scheduler: str) -> Client:
    """Return a client of the scheduler at an address.

    Raises
    ------
    InputError : Dask is not installed; no address; no scheduler there.
    """
    try:
        from dask import config
        from distributed import Client
    except ImportError:
        raise InputError(
            "--scheduler: Dask is not installed",
            found=scheduler,
            expected="the extra `cluster`",
            hint=install_hint("cluster"),
        ) from None
    expected = "an address such as tcp://host:8786"
    if not _ADDRESS.fullmatch(scheduler):
        # Dask would look for a host of that name for a long time.
        raise InputError("not an address", field="--scheduler", found=scheduler, expected=expected)
    # Data go with their task on purpose: scattered, they would die with the one worker that holds them.
    config.set({"distributed.admin.large-graph-warning-threshold": "1TB"})
    try:
        return Client(scheduler, timeout=PATIENCE_S, set_as_default=False)
    except (OSError, TimeoutError, ValueError, TypeError) as reason:
        raise InputError(
            "no scheduler can be reached",
            file=scheduler,
            found=str(reason).split("\n")[0] or type(reason).__name__,
            expected=expected,
            hint="start one with `dask scheduler`, and workers with `dask worker ADDRESS --nthreads 1`",
        ) from None


def check_workers(client: Client, scheduler: str, code: Callable[[], str]) -> None:
    """Raise `InputError` where there are no workers, or one whose `code()` or Python is another than here."""
    try:
        client.wait_for_workers(1, timeout=PATIENCE_S)
    except TimeoutError:
        hint = f"dask worker {scheduler} --nthreads 1"
        raise InputError("the scheduler has no workers", file=scheduler, found="none", hint=hint) from None
    ours = _environment(code)
    hint = "install the same version of metamer, with the same Python, on every worker"
    for worker, theirs in client.run(_environment, code, on_error="return").items():
        if theirs != ours:
            found = theirs if isinstance(theirs, Exception) else f"another version (Python {theirs[1]})"
            raise InputError(
                "a worker has not the metamer that is here", file=scheduler, field=worker, found=found, hint=hint
            )


def scheduler_lost(client: Client, future: Any) -> bool:
    """Return whether a future gave no result because its scheduler is gone."""
    return client.status != "running" or future.status in ("lost", "cancelled")


def lost(scheduler: str) -> InputError:
    """Make the error of a lost scheduler."""
    hint = "start it again, and repeat the command: it goes on from here"
    return InputError("the scheduler was lost on the way", file=scheduler, hint=hint)


def _environment(code: Callable[[], str]) -> tuple[str, str]:
    """Return what has to be equal here and there: the code of the work, and the Python that pickles it."""
    import platform

    return code(), ".".join(platform.python_version_tuple()[:2])
