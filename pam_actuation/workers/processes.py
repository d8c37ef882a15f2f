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

"""Processes of this machine, each by itself: one that is lost costs its own task only."""

from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from multiprocessing import resource_tracker as standard_tracker
import os
import threading
from typing import Any

from joblib.externals.loky.backend import resource_tracker
from joblib.externals.loky.process_executor import (
    BrokenProcessPool, ProcessPoolExecutor)
from pam_actuation.interrupts import kept_from_children
from pam_actuation.parallel import silent_trackers
from pam_actuation.workers.calls import call, end_with, packed, warm_up
from pam_actuation.workers.errors import WorkerLost

TRIES = 3           # processes that one task may take down before it is given up


class Processes:
    """
    A number of processes, out of reach of Ctrl-C; they end with this one.

    Parameters
    ----------
    count : int
        How many.
    modules : tuple of str
        Imported in each of them ahead of the first task.

    """

    def __init__(self, count: int, modules: tuple[str, ...] = ()) -> None:
        self.size = count
        self._modules = modules
        self._lock = threading.Lock()
        self._executors: list[ProcessPoolExecutor] = []
        self._free: list[ProcessPoolExecutor] = []
        with silent_trackers():
            for tracker in (resource_tracker, standard_tracker):
                tracker.ensure_running()
        for _ in range(count):
            self._free.append(self._started())

    def _started(self) -> ProcessPoolExecutor:
        executor = ProcessPoolExecutor(
            max_workers=1, initializer=_begin, initargs=(
                os.getpid(), self._modules, max((os.cpu_count() or 1) // self.size, 1)))
        self._executors.append(executor)
        return executor

    def share(self, shared: Any) -> tuple[str, bytes]:
        """Return what ``submit`` takes for something that all tasks need."""
        return packed(shared)

    def submit(self, function: Callable[[Any, Any], Any], shared: tuple[str, bytes],
               item: Any) -> 'Future[Any]':
        """Begin a task; at most ``size`` may be under way."""
        with self._lock:
            executor = self._free.pop()
        task: Future[Any] = Future()
        self._begin(task, executor, (function, *shared, item), 1)
        return task

    def _begin(self, task: 'Future[Any]', executor: ProcessPoolExecutor,
               arguments: tuple[Any, ...], tries: int) -> None:
        try:
            with kept_from_children():
                inner = executor.submit(call, *arguments)
        except BrokenProcessPool:
            # It ended while it had nothing to do, which is no fault of this task.
            executor = self._replaced(executor)
            with kept_from_children():
                inner = executor.submit(call, *arguments)
        inner.add_done_callback(lambda done: self._end(task, executor, arguments, tries, done))

    def _end(self, task: 'Future[Any]', executor: ProcessPoolExecutor,
             arguments: tuple[Any, ...], tries: int, done: 'Future[Any]') -> None:
        """Pass on what came out; a process that was lost is replaced."""
        if done.cancelled():
            task.cancel()
            return
        error = done.exception()
        if isinstance(error, BrokenProcessPool):
            # Of a thread of its own: this one belongs to the executor that broke.
            threading.Thread(target=self._again, args=(task, executor, arguments, tries)).start()
            return
        with self._lock:
            self._free.append(executor)
        if error is not None:
            task.set_exception(error)
        else:
            task.set_result(done.result())

    def _replaced(self, broken: ProcessPoolExecutor) -> ProcessPoolExecutor:
        """Return a process in the place of one that was lost."""
        with self._lock:
            self._executors.remove(broken)
            executor = self._started()
        broken.shutdown(wait=False)
        return executor

    def _again(self, task: 'Future[Any]', broken: ProcessPoolExecutor,
               arguments: tuple[Any, ...], tries: int) -> None:
        executor = self._replaced(broken)
        if tries < TRIES:
            self._begin(task, executor, arguments, tries + 1)
            return
        with self._lock:
            self._free.append(executor)
        task.set_exception(WorkerLost(
            f'the process that worked on it ended {TRIES} times before the work was done'))

    def wait(self, tasks: 'Iterable[Future[Any]]') -> 'list[Future[Any]]':
        """Wait until some task is done; return all that are."""
        return list(wait(tasks, return_when=FIRST_COMPLETED).done)

    def gather(self, function: Callable[[Any, Any], Any], shared: tuple[str, bytes],
               items: list[Any]) -> list[Any]:
        """Return the results of all items, in order."""
        results: list[Any] = [None] * len(items)
        under_way: dict[Future[Any], int] = {}
        for index, item in enumerate(items):
            if len(under_way) == self.size:
                for done in self.wait(under_way):
                    results[under_way.pop(done)] = done.result()
            under_way[self.submit(function, shared, item)] = index
        for done, index in under_way.items():
            results[index] = done.result()
        return results

    def close(self) -> None:
        """End the processes; what they are at is lost."""
        for executor in self._executors:
            executor.shutdown(wait=True, kill_workers=True)


def _begin(parent: int, modules: tuple[str, ...], threads: int) -> None:
    """Prepare a new process."""
    end_with(parent)
    warm_up(*modules, threads=threads)
