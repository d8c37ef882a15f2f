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

"""Work in processes of joblib that Ctrl-C does not reach: who started them ends them."""

from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker as standard_tracker
import sys
from typing import Any, TypeVar
import warnings

import joblib
from joblib.externals.loky.backend import resource_tracker
from pam_actuation.interrupts import kept_from_children
from pam_actuation.priority import give_way

R = TypeVar('R')
Results = Generator[R, None, None]


def in_processes(jobs: int, calls: Iterable[tuple[Any, ...]]) -> Results[Any]:
    """
    Return a generator of the results of some calls, in their order; they begin at once.

    Parameters
    ----------
    jobs : int
        Processes; -1 for as many as there are cores.
    calls : iterable
        Each from ``joblib.delayed``.

    """
    # The start of a tracker lets signals through again, in the middle of those of the workers.
    with silent_trackers():
        for tracker in (resource_tracker, standard_tracker):
            tracker.ensure_running()
    with kept_from_children():
        results: Results[Any] = joblib.Parallel(n_jobs=jobs, return_as='generator')(calls)
        return results


def giving_way(call: Callable[..., R], *arguments: Any) -> R:
    """
    Return what a call returns; from now on this process has a low priority.

    For calls ``in_processes`` beside live nodes: these go first.
    """
    give_way()
    return call(*arguments)


def abandon(*results: Results[Any]) -> None:
    """End the calls of ``in_processes`` whose results are not wanted any more."""
    with warnings.catch_warnings():
        warnings.simplefilter('ignore', UserWarning)        # joblib's, that they did not end
        for one in results:
            one.close()


@contextmanager
def silent_trackers() -> Iterator[None]:
    """
    Let trackers that are started meanwhile give no warnings.

    After Ctrl-C they and this process clean up at the same time. The second one finds nothing and
    would report that, below the one line for the user.
    """
    sys.warnoptions.append('ignore:resource_tracker')       # handed on to the trackers
    try:
        yield
    finally:
        sys.warnoptions.remove('ignore:resource_tracker')
