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

"""Where tasks run: threads, processes and a Dask cluster give the same, mistakes a sentence."""

import os
import signal
import sys
import time

from divisions import divided, own_pid
from pam_actuation.control.config import load_controller
from pam_actuation.experiments.experiment import load_experiment
from pam_actuation.tuning.loops_of_rigs import loops_of
from pam_actuation.tuning.problem import cost_of, costs_of, Problem
from pam_actuation.tuning.tune import tune
from pam_actuation.workers import ClusterLost, dask_cluster, WorkerLost, Workers
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.rollout.batch import Record, simulate_batch, TASK_RUNS
import pytest

BUDGET = 40


@pytest.fixture(scope='module')
def rig():
    return load_rig('dmsp_5_300_realistic')


def tuned(rig, **where):
    return tune(rig, load_controller('sofc_untuned', rig), load_experiment('short_sine'),
                budget=BUDGET, seed=4, **where)


def test_same_bytes_with_any_number_of_threads_and_on_a_dask_cluster(rig, monkeypatch):
    distributed = pytest.importorskip(
        'distributed', reason='Dask is not installed: pip install "pam_actuation[cluster]"')
    one, two = tuned(rig), tuned(rig, jobs=2)
    assert one.to_yaml() == two.to_yaml()
    assert one.history == two.history
    with distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, host='127.0.0.1', dashboard_address=None,
            worker_dashboard_address=None) as cluster:
        cluster.wait_for_workers(2)
        spread = tuned(rig, cluster=cluster.scheduler_address)
        monkeypatch.setattr(dask_cluster, 'SILENT_S', 0.5)
        with Workers(cluster=cluster.scheduler_address) as workers:
            assert workers.map(pow, 2, (3, 4)) == [8, 16]
            cluster.close()
            with pytest.raises(ClusterLost, match='was lost'):
                list(workers.stream(pow, 2, (3, 4)))
    assert spread.to_yaml() == one.to_yaml()
    assert spread.history == one.history
    assert spread.held_out_after == one.held_out_after


@pytest.mark.parametrize('address, says', [
    ('http://somewhere', 'no address of a cluster'),
    ('tcp://nonsense', 'no Dask scheduler')])
def test_a_wrong_address_is_named(rig, address, says):
    if address.startswith('tcp'):
        pytest.importorskip('distributed')
    with pytest.raises(InputError, match=says):
        tuned(rig, cluster=address)


@pytest.mark.parametrize('address, library, says', [
    ('tcp://127.0.0.1:8786', 'dask.distributed', 'needs Dask'),
    ('ray://127.0.0.1:10001', 'ray', 'needs Ray')])
def test_a_missing_library_is_named(monkeypatch, address, library, says):
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(InputError, match=says):
        Workers(cluster=address).__enter__()


def test_workers_that_cannot_be_are_refused():
    for jobs in (0, -3, 1.5, 'x'):
        with pytest.raises(InputError, match='jobs: is .*; allowed are 1 or more, and -1'):
            Workers(jobs)
    with pytest.raises(InputError, match='is used before its block; write `with Workers'):
        Workers().map(lambda shared, item: item, None, [1])


def test_results_keep_the_order_of_the_items():
    class Square:

        def cost(self, item):
            return item * item

    with Workers(jobs=2) as workers:
        assert workers.map(cost_of, Square(), range(20)) == [i * i for i in range(20)]


def test_a_lost_process_costs_its_own_task_only(tmp_path):
    with Workers(jobs=2, processes=True) as workers:
        found = dict(workers.stream(divided, tmp_path, range(6)))
        assert workers.map(divided, tmp_path, [1, 2, 4]) == [10.0, 5.0, 2.5]
        _batch_is_the_same_elsewhere(workers)
    assert isinstance(found.pop(0), ZeroDivisionError)
    assert isinstance(found.pop(5), WorkerLost)
    assert found == {1: 10.0, 2: 5.0, 3: 10 / 3, 4: 2.5}


def test_a_process_that_is_lost_while_it_is_idle_is_replaced(tmp_path):
    with Workers(jobs=1, processes=True) as workers:
        lost, = workers.map(own_pid, None, [0])
        broken, = workers._pool._executors
        os.kill(lost, signal.SIGKILL)
        deadline = time.monotonic() + 20.0
        while broken._flags.broken is None:         # what is lost is not known at once
            assert time.monotonic() < deadline
            time.sleep(0.01)
        assert dict(workers.stream(divided, tmp_path, [1, 3])) == {1: 10.0, 3: 10 / 3}
        assert workers.map(own_pid, None, [0]) != [lost]


def _batch_is_the_same_elsewhere(workers):
    """Hold simulations of other processes against those of this one."""
    rig, signal = load_rig('dmsp_5_300_hanging_mass'), [3.0] * 50
    rigs = [rig.with_(parameters={'mass_kg': 4.0 + 0.1 * k}) for k in range(TASK_RUNS + 2)]
    how = {'keep': ('force_n', 'time_s'), 'every': 3}
    here = simulate_batch(rigs, Record(signal), **how)
    there = simulate_batch(rigs, Record(signal), spread=workers.map, **how)
    assert len(here) == len(there) == len(rigs)
    for one, other in zip(here, there):
        assert one.outputs.tobytes() == other.outputs.tobytes()
        assert one.force_n.tobytes() == other.force_n.tobytes()
    records = [Record(signal)] * TASK_RUNS + [Record([])]
    with pytest.raises(InputError) as known:
        simulate_batch(rig, records)
    with pytest.raises(InputError) as told:
        simulate_batch(rig, records, spread=workers.map)
    assert str(told.value) == str(known.value) and f'run {TASK_RUNS}' in str(told.value)


def test_points_and_loops_apart_cost_the_same(rig):
    experiments = [load_experiment('short_sine'), load_experiment('tuning_one_hz')]
    for name in ('pid', 'sofc_untuned'):
        controller = load_controller(name, rig)
        loops, _ = loops_of([rig], experiments, 0, controller, rig)
        problem, points = Problem(loops, controller), [{}, {'max_pressure_gauge_pa': 5e5}]
        with Workers(jobs=2) as two, Workers(jobs=1) as one:
            apart, together = costs_of(two, problem, points), costs_of(one, problem, points)
        assert apart == together == [problem.cost(point) for point in points]
