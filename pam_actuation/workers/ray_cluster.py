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

"""Tasks on a Ray cluster that exists already."""

from collections.abc import Callable, Iterable, Iterator
import contextlib
import time
from typing import Any

from pam_actuation.workers.calls import call, packed, THREADS, warm_up
from pam_actuation.workers.errors import ClusterLost, WorkerLost
from pam_sim.errors import InputError

NO_CLIENT = ('needs the client of Ray, which `ray` alone does not bring: '
             'pip install "pam_actuation[ray]"')
TRIES_AGAIN = 3     # of a task whose worker was lost
# A busy cluster may fail to start the process that serves a client, and do it a moment later.
CONNECTS, BETWEEN_S, NOT_YET = 5, 1.0, 'Initialization failure'


class RayCluster:
    """
    The workers of a Ray cluster.

    Parameters
    ----------
    address : str
        Of its client server, ``ray://host:10001``.
    modules : tuple of str
        Imported by each worker with its first task.

    Raises
    ------
    InputError
        Ray or its client is not installed, or nobody answers.

    """

    def __init__(self, address: str, modules: tuple[str, ...] = ()) -> None:
        try:
            import ray
        except ImportError:
            raise InputError(
                'needs Ray: pip install "pam_actuation[ray]", here and on the workers',
                'cluster') from None
        engine: Any = ray       # whatever of its types this version tells
        for tried in range(1, CONNECTS + 1):
            try:
                engine.init(address, log_to_driver=False, logging_level='ERROR', runtime_env={
                    'env_vars': {THREADS: '1', 'OPENBLAS_NUM_THREADS': '1'}})
                break
            except ImportError:     # raised where the address is first looked at
                raise InputError(NO_CLIENT, 'cluster') from None
            except (ConnectionError, OSError, ValueError) as error:
                if 'ray[client]' in str(error):
                    raise InputError(NO_CLIENT, 'cluster') from None
                if tried == CONNECTS or NOT_YET not in str(error):
                    why = str(error).partition('\n')[0]
                    raise InputError(
                        f'no Ray cluster answers at {address}: {why}', 'cluster') from None
            time.sleep(BETWEEN_S)
        self._ray, self._address, self._modules = engine, address, modules
        self._call = engine.remote(_warm_call).options(max_retries=TRIES_AGAIN, num_cpus=1)

    @contextlib.contextmanager
    def _asked(self) -> Iterator[None]:
        """Ask the cluster; ClusterLost where the connection breaks meanwhile."""
        try:
            yield
        except OSError as error:
            raise self._lost() from error

    def _lost(self) -> ClusterLost:
        return ClusterLost(f'the Ray cluster at {self._address} was lost')

    @property
    def size(self) -> int:
        """Return the number of tasks that the cluster does at a time; ClusterLost if gone."""
        with self._asked():
            return max(int(self._ray.cluster_resources().get('CPU', 1)), 1)

    def share(self, shared: Any) -> tuple[str, Any]:
        """Return what ``submit`` takes for something that all tasks need; ClusterLost if gone."""
        key, blob = packed(shared)
        with self._asked():
            return key, self._ray.put(blob)

    def submit(self, function: Callable[[Any, Any], Any], shared: tuple[str, Any],
               item: Any) -> '_Task':
        """Begin a task; ClusterLost where Ray is gone."""
        with self._asked():
            return _Task(self, self._call.remote(self._modules, function, *shared, item))

    def wait(self, tasks: 'Iterable[_Task]') -> 'list[_Task]':
        """Wait until some task is done; return all that are. ClusterLost where Ray is gone."""
        tasks = list(tasks)
        by_reference = {task.reference: task for task in tasks}
        with self._asked():
            done, _ = self._ray.wait(list(by_reference), num_returns=1)
            more, _ = self._ray.wait(list(by_reference), num_returns=len(tasks), timeout=0)
        return [by_reference[one] for one in dict.fromkeys([*done, *more])]

    def gather(self, function: Callable[[Any, Any], Any], shared: tuple[str, Any],
               items: list[Any]) -> list[Any]:
        """Return the results of all items, in order."""
        tasks = [self.submit(function, shared, item) for item in items]
        return [task.result() for task in tasks]

    def result(self, reference: Any) -> Any:
        """Return what a task returned; raise what it raised, WorkerLost or ClusterLost."""
        errors = self._ray.exceptions
        try:
            return self._ray.get(reference)
        except errors.RayTaskError as error:
            raise (error.cause if isinstance(error.cause, Exception) else error) from None
        except (errors.WorkerCrashedError, errors.OutOfMemoryError, errors.NodeDiedError):
            raise WorkerLost('the workers that began it ended before it was done') from None
        except OSError as error:        # last: an error of a task may be one as well
            raise self._lost() from error

    def close(self) -> None:
        """Let go of the cluster; it goes on."""
        self._ray.shutdown()


class _Task:
    """A task of Ray that can be asked for its result."""

    def __init__(self, cluster: RayCluster, reference: Any) -> None:
        self._cluster, self.reference = cluster, reference

    def result(self) -> Any:
        """Return what the task returned; raise as ``RayCluster.result``."""
        return self._cluster.result(self.reference)


def _warm_call(modules: tuple[str, ...], function: Callable[[Any, Any], Any], key: str,
               blob: bytes, item: Any) -> Any:
    warm_up(*modules)
    return call(function, key, blob, item)
