# Copyright 2026 pam_actuation developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""The one place to run independent tasks: here, or on a cluster."""

from collections.abc import Callable, Iterable, Iterator
import contextlib
import functools
import math
import numbers
import os
import time
from typing import Any, Protocol, Self, TypeVar

import joblib
from pam_actuation.workers.dask_cluster import DaskCluster
from pam_actuation.workers.errors import ClusterLost, WorkerLost
from pam_actuation.workers.processes import Processes
from pam_actuation.workers.ray_cluster import RayCluster
from pam_sim.errors import InputError

PER_WORKER = 3          # tasks of a stream at a cluster, so that none of its workers waits
COUNTED_S = 2.0         # a cluster is asked how large it is no more often
Given = TypeVar('Given')
Item = TypeVar('Item')
Result = TypeVar('Result')


class Pool(Protocol):
    """What tasks are handed to; see ``processes``, ``dask_cluster`` and ``ray_cluster``."""

    @property
    def size(self) -> int:
        """Return the number of tasks done at a time."""

    def share(self, shared: Any) -> Any:
        """Return what ``submit`` takes for something that all tasks need."""

    def submit(self, function: Callable[[Any, Any], Any], shared: Any, item: Any) -> Any:
        """Begin a task."""

    def wait(self, tasks: Iterable[Any]) -> list[Any]:
        """Wait until some task is done; return all that are."""

    def gather(self, function: Callable[[Any, Any], Any], shared: Any,
               items: list[Any]) -> list[Any]:
        """Return the results of all items, in order."""

    def close(self) -> None:
        """Let go of it."""


def _check_jobs(jobs: Any) -> None:
    """Refuse what is no number of threads or processes."""
    if not isinstance(jobs, numbers.Integral) or int(jobs) < 1 and int(jobs) != -1:
        raise InputError(f'is {jobs!r}; allowed are 1 or more, and -1 for one a core', 'jobs')


class Workers:
    """
    A place to run tasks, used in a ``with`` block.

    Parameters
    ----------
    jobs : int
        Local threads or processes; -1 for all cores. On a cluster its size counts instead.
    cluster : str, optional
        Address of a Dask scheduler (``tcp://``, ``tls://``) or a Ray cluster (``ray://``).
    processes : bool
        Local processes instead of threads: for work that holds the interpreter's lock.
    modules : tuple of str
        Imported ahead of the first task by each process.

    Raises
    ------
    InputError
        A number of jobs that cannot be, an address of neither kind, the library is not
        installed, or nobody answers.

    """

    def __init__(self, jobs: int = 1, cluster: str | None = None, processes: bool = False,
                 modules: tuple[str, ...] = ()) -> None:
        _check_jobs(jobs)
        self.jobs, self.cluster, self.processes, self.modules = jobs, cluster, processes, modules
        self._parallel: joblib.Parallel | None = None
        self._pool: Pool | None = None
        self._stack = contextlib.ExitStack()
        if cluster is not None and not str(cluster).startswith(('tcp://', 'tls://', 'ray://')):
            raise InputError(
                f'`{cluster}` is no address of a cluster; give tcp://HOST:PORT of a Dask '
                'scheduler or ray://HOST:PORT', 'cluster')

    def __enter__(self) -> Self:
        """Connect, and start threads or processes."""
        if self.cluster is None and not self.processes:
            self._parallel = self._stack.enter_context(
                joblib.Parallel(n_jobs=self.jobs, prefer='threads'))
            return self
        if self.cluster is None:
            self._pool = Processes(self.size, self.modules)
        else:
            kind = RayCluster if self.cluster.startswith('ray://') else DaskCluster
            self._pool = kind(self.cluster, self.modules)
        self._stack.callback(self._pool.close)
        return self

    def __exit__(self, *details: object) -> None:
        """Let go of threads, processes and cluster."""
        self._stack.close()
        self._parallel = self._pool = None

    @property
    def size(self) -> int:
        """Return the number of tasks that are done at a time."""
        if self._pool is not None:
            return self._pool.size
        return self.jobs if self.jobs > 0 else os.cpu_count() or 1

    @property
    def spread(self) -> bool:
        """Return whether tasks leave this process, so that small ones share the work better."""
        return self._pool is not None

    def map(self, function: Callable[[Given, Item], Result], shared: Given,  # noqa: A003
            items: Iterable[Item]) -> list[Result]:
        """
        Return ``[function(shared, item) for item in items]``, computed in parallel.

        ``function`` stands at the top of a module, ``shared`` can be pickled; each process
        unpacks it once.

        Raises
        ------
        WorkerLost, ClusterLost
            See ``errors``.
        InputError
            It is used outside of its block.

        """
        if self._pool is not None:
            return self._pool.gather(function, self._pool.share(shared), list(items))
        if self._parallel is None:
            raise InputError('is used before its block; write `with Workers(...) as workers:`',
                             'workers')
        call = joblib.delayed(functools.partial(function, shared))
        done: list[Result] = self._parallel(call(item) for item in items)
        return done

    def stream(self, function: Callable[[Given, Item], Result], shared: Given,
               items: Iterable[Item]) -> 'Iterator[tuple[Item, Result | Exception]]':
        """
        Give (item, result) as they come; in place of a result the error that a task ended with.

        Raises
        ------
        ClusterLost
            As of ``map``. A task whose workers were lost is tried once more, alone at the end;
            then that is its error.

        """
        if self._pool is None:
            for item in items:
                yield item, _caught(functools.partial(function, shared, item))
            return
        pool, given = self._pool, self._pool.share(shared)
        under_way: dict[Any, Item] = {}
        lost: list[Item] = []

        def ended() -> 'Iterator[tuple[Item, Result | Exception]]':
            for task in pool.wait(under_way):
                item, result = under_way.pop(task), _caught(task.result)
                if isinstance(result, WorkerLost):
                    lost.append(item)
                else:
                    yield item, result

        room, counted_s = 0, -math.inf
        for item in items:
            if time.monotonic() - counted_s > COUNTED_S:    # workers may have come
                room = pool.size * (PER_WORKER if self.cluster is not None else 1)
                counted_s = time.monotonic()
            while len(under_way) >= room:
                yield from ended()
            under_way[pool.submit(function, given, item)] = item
        while under_way:
            yield from ended()
        for item in lost:       # alone, in case another task took the worker down
            task = pool.submit(function, given, item)
            pool.wait([task])
            yield item, _caught(task.result)


def _caught(result: Callable[[], Result]) -> Result | Exception:
    """Return a result, or the error instead of it; a lost cluster is one of all tasks."""
    try:
        return result()
    except ClusterLost:
        raise
    except Exception as error:      # noqa: B902, of any task, which is a result of it
        return error
