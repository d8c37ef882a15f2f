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

"""Tasks on a Dask cluster that exists already."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError
import contextlib
import time
from typing import Any

from pam_actuation.workers.calls import call, packed, warm_up
from pam_actuation.workers.errors import ClusterLost, WorkerLost
from pam_sim.errors import InputError

WAIT_S = 15         # for an answer of the scheduler
SILENT_S = 30       # without a connection after which the scheduler counts as lost
LOOKED_S = 2


class DaskCluster:
    """
    The workers of a Dask scheduler.

    Parameters
    ----------
    address : str
        Of the scheduler, ``tcp://host:8786``.
    modules : tuple of str
        Imported in each worker ahead of the first task, also in workers that come later.

    Raises
    ------
    InputError
        Dask is not installed, or nobody answers.

    """

    def __init__(self, address: str, modules: tuple[str, ...] = ()) -> None:
        try:
            from dask.distributed import Client, WorkerPlugin
        except ImportError:
            raise InputError(
                'needs Dask: pip install "pam_actuation[cluster]", here and on the workers',
                'cluster') from None

        class WarmUp(WorkerPlugin):     # type: ignore[misc]  # Dask has no types
            """Imports what tasks need when a worker starts."""

            name = 'pam_actuation'

            def setup(self, worker: Any) -> None:
                """Import."""
                warm_up(*modules)

        self._address = address
        with contextlib.ExitStack() as stack:
            try:
                self._client = Client(address, timeout=WAIT_S, set_as_default=False)
                stack.callback(self.close)
                self._client.register_plugin(WarmUp())
            except (OSError, ValueError) as error:
                raise InputError(
                    f'no Dask scheduler answers at {address}: {error}', 'cluster') from None
            stack.pop_all()

    @contextlib.contextmanager
    def _asked(self) -> Iterator[None]:
        """Ask the scheduler; ClusterLost where the connection breaks meanwhile."""
        try:
            yield
        except (OSError, CancelledError) as error:
            raise self.lost() from error

    @property
    def size(self) -> int:
        """Return the number of tasks that the workers of now do at a time; ClusterLost if gone."""
        with self._asked():
            return max(sum(self._client.nthreads().values()), 1)

    def share(self, shared: Any) -> tuple[str, Any]:
        """
        Return what ``submit`` takes for something that all tasks need.

        The bytes are the result of a task: the scheduler makes them anew where the workers
        that held them are lost. ClusterLost as ``wait``.
        """
        key, blob = packed(shared)
        with self._asked():
            return key, self._client.submit(_same, blob, key=f'pam-shared-{key}')

    def submit(self, function: Callable[[Any, Any], Any], shared: tuple[str, Any],
               item: Any) -> '_Task':
        """Begin a task; ClusterLost as ``wait``."""
        key, blob = shared
        with self._asked():
            return _Task(self, self._client.submit(call, function, key, blob, item, pure=False))

    def wait(self, tasks: 'Iterable[_Task]') -> 'list[_Task]':
        """
        Wait until some task is done; return all that are.

        Raises
        ------
        ClusterLost
            The scheduler is gone.

        """
        from dask.distributed import wait
        tasks, heard_s = list(tasks), time.monotonic()
        while True:
            # Raises where a task was cancelled, too: that is seen below.
            with self._client.as_current(), contextlib.suppress(
                    TimeoutError, OSError, CancelledError):
                wait([task.future for task in tasks], timeout=LOOKED_S,
                     return_when='FIRST_COMPLETED')
            done = [task for task in tasks if task.future.done()]
            if done:
                return done
            if self._client.status == 'running':
                heard_s = time.monotonic()
            elif time.monotonic() - heard_s > SILENT_S:
                raise self.lost()

    def gather(self, function: Callable[[Any, Any], Any], shared: tuple[str, Any],
               items: list[Any]) -> list[Any]:
        """Return the results of all items, in order; ClusterLost as ``wait``."""
        (key, blob), n = shared, len(items)
        with self._asked():
            tasks = [_Task(self, future) for future in self._client.map(
                call, [function] * n, [key] * n, [blob] * n, items, pure=False)]
        waiting = tasks
        while waiting:
            for task in self.wait(waiting):
                if task.future.status != 'finished':
                    task.result()       # raises
            waiting = [task for task in waiting if not task.future.done()]
        with self._asked():
            found: list[Any] = self._client.gather([task.future for task in tasks])
        return found

    def lost(self) -> ClusterLost:
        """Return what says that the scheduler was lost."""
        return ClusterLost(f'the Dask scheduler at {self._address} was lost')

    def close(self) -> None:
        """Let go of the cluster; it goes on."""
        self._client.close(timeout=LOOKED_S)


class _Task:
    """A task of Dask that can be asked for its result."""

    def __init__(self, cluster: DaskCluster, future: Any) -> None:
        self._cluster, self.future = cluster, future

    def result(self) -> Any:
        """Return what the task returned; raise what it raised, WorkerLost or ClusterLost."""
        from dask.distributed import KilledWorker
        from distributed.comm import CommClosedError
        if self.future.status in ('cancelled', 'lost'):
            raise self._cluster.lost()
        try:
            return self.future.result(timeout=WAIT_S)
        except KilledWorker:
            raise WorkerLost('the workers that began it ended before it was done') from None
        except (CancelledError, CommClosedError, TimeoutError):
            raise self._cluster.lost() from None


def _same(blob: bytes) -> bytes:
    return blob
