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

"""The steps by which a reference generator plays another experiment, against a pretended one."""

import pytest

pytest.importorskip('rclpy')

from lifecycle_msgs.srv import ChangeState, GetState  # noqa: E402, I100
from pam_actuation.nodes.view_player import (  # noqa: E402
    Refused, steps_to_play, steps_to_stop)
from rcl_interfaces.msg import ParameterValue, SetParametersResult  # noqa: E402
from rcl_interfaces.srv import GetParameters, SetParameters  # noqa: E402

pytestmark = pytest.mark.ros

UNCONFIGURED, INACTIVE, ACTIVE = 1, 2, 3
# Transition: state before and after.
WAYS = {1: (UNCONFIGURED, INACTIVE), 2: (INACTIVE, UNCONFIGURED), 3: (INACTIVE, ACTIVE),
        4: (ACTIVE, INACTIVE)}


class Pretended:
    """A reference generator with state and experiment; ``fails`` is a transition it refuses."""

    def __init__(self, state, experiment='sine_quarter_hz', fails=0, takes=True):
        self.state, self.experiment = state, experiment
        self._fails, self._takes = fails, takes

    def answer(self, service, request):
        if service == 'get_state':
            response = GetState.Response()
            response.current_state.id = self.state
            return response
        if service == 'get_parameters':
            return GetParameters.Response(values=[
                ParameterValue(type=4, string_value=self.experiment)])
        if service == 'set_parameters':
            assert self.state == UNCONFIGURED
            if self._takes:
                self.experiment = request.parameters[0].value.string_value
            return SetParameters.Response(results=[
                SetParametersResult(successful=self._takes, reason='' if self._takes else 'no')])
        before, after = WAYS[request.transition.id]
        done = request.transition.id != self._fails and self.state == before
        self.state = after if done else self.state
        return ChangeState.Response(success=done)

    def led_through(self, steps):
        """Return what the steps say at the end."""
        response = None
        while True:
            try:
                service, request = steps.send(response)
            except StopIteration as ended:
                return ended.value
            response = self.answer(service, request)


@pytest.mark.parametrize('state', [UNCONFIGURED, INACTIVE, ACTIVE])
def test_from_any_state_it_plays_the_other_experiment(state):
    player = Pretended(state)
    assert player.led_through(steps_to_play('staircase')) == 'plays staircase'
    assert (player.state, player.experiment) == (ACTIVE, 'staircase')


def test_stopping_is_told_and_harmless_where_nothing_plays():
    player = Pretended(ACTIVE)
    assert player.led_through(steps_to_stop()) == 'stopped' and player.state == INACTIVE
    assert player.led_through(steps_to_stop()) == 'played nothing'


def test_another_domain_is_refused_before_anything_is_taken_down():
    player = Pretended(ACTIVE)
    with pytest.raises(Refused, match='in joint_angle, this rig is asked in contraction'):
        player.led_through(steps_to_play('joint_sine'))
    assert player.state == ACTIVE
    with pytest.raises(Refused, match='cannot be read here'):
        Pretended(ACTIVE, '/none.yaml').led_through(steps_to_play('staircase'))


@pytest.mark.parametrize('fails, takes, why', [
    (4, True, 'did not deactivate'), (2, True, 'did not cleanup'), (0, False, 'no'),
    (1, True, 'did not configure'), (3, True, 'did not activate')])
def test_a_step_that_fails_is_told_and_nothing_plays(fails, takes, why):
    player = Pretended(ACTIVE, fails=fails, takes=takes)
    with pytest.raises(Refused, match=why):
        player.led_through(steps_to_play('staircase'))
    assert player.state != ACTIVE or fails == 4
