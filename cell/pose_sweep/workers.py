"""Runs a sweep in worker processes, or in any executor of ``concurrent.futures``.

    with worker_processes(2) as pool:
        for result in completed(pool, units): ...          # units are callables that can be pickled
    with dask_cluster("tcp://127.0.0.1:8786") as executor:
        sweep(case, poses, executor=executor)

Results come as they are done. A unit is sent only when few are waiting, so that a long sweep takes no more memory
than a short one.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from itertools import islice
from multiprocessing import active_children, get_context
from queue import SimpleQueue
from typing import TypeVar

from ..errors import InputError
from ..processes.own_process import begin_worker, uninterrupted
from ..termination import Terminated

AHEAD = 256  # units sent and not yet back
CONNECT_S = 10

T = TypeVar("T")


def _call(unit: Callable[[], T]) -> T:
    return unit()


def completed(executor: Executor, units: Iterable[Callable[[], T]]) -> Generator[T, None, None]:
    """Results of units in the order in which they are done.

    Args:
        executor: any.
        units: what to call.

    Yields:
        Results.

    Raises:
        BrokenExecutor: the executor's workers are gone; what they had done has been given before.
    """
    back: SimpleQueue[Future[T]] = SimpleQueue()
    out: set[Future[T]] = set()
    left = iter(units)
    broken: BrokenExecutor | None = None
    try:
        while True:
            for unit in islice(left, 0 if broken else AHEAD - len(out)):
                with uninterrupted():
                    try:
                        future = executor.submit(_call, unit)
                    except BrokenExecutor as error:
                        broken = error
                        break
                out.add(future)
                future.add_done_callback(back.put)
            if not out:
                break
            future = back.get()
            out.discard(future)
            try:
                result = future.result()
            except BrokenExecutor as error:
                broken = error
                continue
            yield result
    finally:
        for future in out:
            future.cancel()
    if broken is not None:
        raise broken


@contextmanager
def worker_processes(workers: int) -> Iterator[Executor]:
    """Processes that end with the block and with their parent; on Ctrl-C the unit they are at is finished first.

    Args:
        workers: how many.

    Yields:
        The executor.
    """
    # spawned, not forked: the same on every system, and no thread of the parent is copied half-way
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=begin_worker)
    try:
        yield pool
    except Terminated:
        for process in active_children():  # a pose may take minutes, which is too long to wait for at the end
            process.terminate()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def dask_cluster(address: str) -> Iterator[Executor]:
    """An executor over a Dask cluster, which has to be able to import this program and to read the case's files.

    Args:
        address: of the scheduler, such as tcp://127.0.0.1:8786.

    Yields:
        The executor.

    Raises:
        InputError: Dask is not installed, no scheduler answers, or the cluster is gone half-way; one line.
    """
    try:
        from distributed import Client, KilledWorker
    except ImportError:
        raise InputError("--dask needs the extra dask: pip install 'rbam-cell[dask]'") from None
    try:
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        why = " ".join(str(error).split())
        raise InputError(f"--dask: no scheduler answers at {address} ({why})") from None
    with client:
        try:
            yield client.get_executor(pure=False)
        except KilledWorker as error:
            raise InputError(f"--dask: the cluster gave up on a pose: {' '.join(str(error).split())}") from None
        except (CancelledError, OSError) as error:
            raise InputError(f"--dask: the cluster at {address} is gone ({type(error).__name__})") from None
