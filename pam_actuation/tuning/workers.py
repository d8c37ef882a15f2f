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

"""
Where rollouts run: threads of this machine, or a cluster that exists already.

All through joblib. Threads suffice here, since compiled rollouts hold no
interpreter lock. A Dask scheduler is named by its address (``tcp://host:8786``),
a Ray cluster likewise (``ray://host:10001``); both libraries are optional. The
order of results does not depend on who computes them.
"""

from collections.abc import Callable, Iterable, Iterator
import contextlib
import functools
import pickle
from typing import Any, Self, TypeVar

import joblib
from pam_sim.errors import InputError

_WAIT_S = 15
Given = TypeVar('Given')
Item = TypeVar('Item')
Result = TypeVar('Result')


class Workers:
    """
    A place to run rollouts, used in a ``with`` block.

    Parameters
    ----------
    jobs : int
        Local threads; -1 for all cores. On a cluster its size counts instead.
    cluster : str, optional
        Address of a Dask scheduler (``tcp://``, ``tls://``) or a Ray cluster (``ray://``).

    Raises
    ------
    InputError
        An address of neither kind, the library is not installed, or nobody answers.

    """

    def __init__(self, jobs: int = 1, cluster: str | None = None) -> None:
        self.jobs, self.cluster = jobs, cluster
        self._parallel: joblib.Parallel | None = None
        self._stack = contextlib.ExitStack()
        if cluster is not None and not str(cluster).startswith(('tcp://', 'tls://', 'ray://')):
            raise InputError(
                f'`{cluster}` is no address of a cluster; give tcp://HOST:PORT of a Dask '
                'scheduler or ray://HOST:PORT', 'cluster')

    def __enter__(self) -> Self:
        """Connect, and start the threads."""
        try:
            if self.cluster is None:
                self._parallel = self._stack.enter_context(
                    joblib.Parallel(n_jobs=self.jobs, prefer='threads'))
            else:
                connect = _ray if self.cluster.startswith('ray://') else _dask
                self._stack.enter_context(connect(self.cluster))
                self._parallel = self._stack.enter_context(joblib.Parallel(n_jobs=-1))
        except BaseException:
            self._stack.close()
            raise
        return self

    def __exit__(self, *details: object) -> None:
        """Let go of threads and cluster."""
        self._stack.close()
        self._parallel = None

    def map(self, function: Callable[[Given, Item], Result], problem: Given,  # noqa: A003
            items: Iterable[Item]) -> list[Result]:
        """
        Return ``[function(problem, item) for item in items]``, computed in parallel.

        ``function`` stands at the top of a module, ``problem`` can be pickled; each process of
        a cluster unpacks it once.
        """
        assert self._parallel is not None, 'used within a with block'
        call = joblib.delayed(functools.partial(function, problem))
        if self.cluster is not None:
            call = joblib.delayed(
                functools.partial(_unpacked_call, function, pickle.dumps(problem)))
        done: list[Result] = self._parallel(call(item) for item in items)
        return done


_NO_RAY_CLIENT = ('needs the client of Ray, which `ray` alone does not bring: '
                  'pip install "pam_actuation[ray]"')


@functools.lru_cache(maxsize=4)
def _unpacked(blob: bytes) -> Any:
    return pickle.loads(blob)


def _unpacked_call(function: Callable[[Any, Item], Result], blob: bytes, item: Item) -> Result:
    """Call in a process of a cluster."""
    return function(_unpacked(blob), item)


@contextlib.contextmanager
def _dask(address: str) -> Iterator[None]:
    """Make an existing Dask scheduler the backend of joblib."""
    try:
        from dask.distributed import Client
    except ImportError:
        raise InputError(
            'needs Dask: pip install "pam_actuation[cluster]", here and on the workers',
            'cluster') from None
    try:
        client = Client(address, timeout=_WAIT_S, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(f'no Dask scheduler answers at {address}: {error}', 'cluster') from None
    with client, client.as_current(), joblib.parallel_config(backend='dask'):
        yield


@contextlib.contextmanager
def _ray(address: str) -> Iterator[None]:
    """Make an existing Ray cluster the backend of joblib."""
    try:
        import ray
        from ray.util.joblib import register_ray
    except ImportError:
        raise InputError(
            'needs Ray: pip install "pam_actuation[ray]", here and on the workers',
            'cluster') from None
    try:
        ray.init(address)
    except ImportError:     # raised where the address is first looked at
        raise InputError(_NO_RAY_CLIENT, 'cluster') from None
    except (ConnectionError, OSError, ValueError) as error:
        if 'ray[client]' in str(error):
            raise InputError(_NO_RAY_CLIENT, 'cluster') from None
        raise InputError(f'no Ray cluster answers at {address}: {error}', 'cluster') from None
    try:
        register_ray()
        with joblib.parallel_config(backend='ray'):
            yield
    finally:
        ray.shutdown()
