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

"""A run of which one node is killed: what the tests of the end of a run share."""

import signal

from pam_actuation.rigging.plan import make_plan
from pam_actuation.rigging.session import Result, RigSession, run_guarded

KILLED_AFTER_S = 1.5


def run_and_kill(victim, experiment, rig, bag, namespace='/muscle', overwrite=False):
    """Run an experiment behind on/off valves until a node is killed; return the Result."""
    plan = make_plan(
        experiment, rig, None, 'hsv', bag, namespace=namespace, overwrite=overwrite)
    result = Result(str(bag))
    with RigSession(plan, namespace) as session:
        def kill(done_s, total_s):
            if done_s > KILLED_AFTER_S:
                session.processes[victim].send_signal(signal.SIGKILL)

        run_guarded(session, result, kill)
    plan.remove()
    assert f'{victim} was ended by SIGKILL' in result.failure
    assert result.exit_codes.pop(victim) == -signal.SIGKILL
    assert set(result.exit_codes.values()) == {0}
    return result
