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
Named experiments from the live page: a reference generator that runs plays another one.

It is taken down by its lifecycle, gets the name and is brought up again. If a step fails, it stays
down: without a reference the controller does what the table of faults says.
"""

from collections.abc import Generator, Iterable
import time
from typing import Any, Final

from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from pam_actuation.resources import find_config, list_config
from pam_actuation.view.source import Answer
from pam_sim.errors import InputError
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.node import Node
import yaml

PLAYER: Final = 'reference_generator'
EXPERIMENT: Final = 'experiment'
LONGEST_S: Final = 15.0         # for all steps, also on a busy machine
SERVICES: Final = {'get_state': GetState, 'change_state': ChangeState,
                   'get_parameters': GetParameters, 'set_parameters': SetParameters}
Steps = Generator[tuple[str, Any], Any, str]


class Refused(Exception):
    """A step was not done; the text says why."""


def experiments() -> list[str]:
    """Return the names of the experiments that come with the package."""
    return list_config('experiments')


def domain_of(name: str) -> str:
    """Return what the values of an experiment are; Refused if its file cannot be read."""
    try:
        found = yaml.safe_load(find_config('experiments', name).read_text(encoding='utf-8'))
        return str(found.get('domain', 'contraction'))
    except (InputError, OSError, ValueError, AttributeError, yaml.YAMLError):
        raise Refused(f'the experiment {name!r} cannot be read here') from None


def steps_to_play(experiment: str) -> Steps:
    """
    Go through the steps by which a reference generator plays another experiment.

    Yields service and request, takes the response, and returns what to say at the end.

    Raises
    ------
    Refused
        A step was not done.

    """
    state = (yield 'get_state', GetState.Request()).current_state.id
    values = (yield 'get_parameters', GetParameters.Request(names=[EXPERIMENT])).values
    before = values[0].string_value if values else ''
    if domain_of(experiment) != domain_of(before):
        raise Refused(f'{experiment} is in {domain_of(experiment)}, this rig is asked in '
                      f'{domain_of(before)}')
    if state == State.PRIMARY_STATE_ACTIVE:
        yield from _change('deactivate', Transition.TRANSITION_DEACTIVATE)
    if state in (State.PRIMARY_STATE_ACTIVE, State.PRIMARY_STATE_INACTIVE):
        yield from _change('cleanup', Transition.TRANSITION_CLEANUP)
    value = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=experiment)
    result = (yield 'set_parameters', SetParameters.Request(
        parameters=[Parameter(name=EXPERIMENT, value=value)])).results[0]
    if not result.successful:
        raise Refused(result.reason or 'the parameter experiment cannot be set')
    yield from _change('configure', Transition.TRANSITION_CONFIGURE)
    yield from _change('activate', Transition.TRANSITION_ACTIVATE)
    return f'plays {experiment}'


def steps_to_stop() -> Steps:
    """Go through the steps by which a reference generator stops; as ``steps_to_play``."""
    state = (yield 'get_state', GetState.Request()).current_state.id
    if state != State.PRIMARY_STATE_ACTIVE:
        return 'played nothing'
    yield from _change('deactivate', Transition.TRANSITION_DEACTIVATE)
    return 'stopped'


def _change(word: str, transition: int) -> Generator[tuple[str, Any], Any, None]:
    request = ChangeState.Request()
    request.transition.id = transition
    if not (yield 'change_state', request).success:
        raise Refused(f'it did not {word}; see its state')


class Playing:
    """
    Steps that some reference generators are led through.

    Parameters
    ----------
    node : rclpy.node.Node
        Whose clients call.
    players : iterable of str
        Full names of the reference generators.
    experiment : str
        What is played; '' to stop.
    answer : callable
        Told at the end what each of them did.

    """

    def __init__(self, node: Node, players: Iterable[str], experiment: str,
                 answer: Answer) -> None:
        self._answer, self._until_s = answer, time.monotonic() + LONGEST_S
        self._led = [_Led(node, player, steps_to_play(experiment) if experiment
                          else steps_to_stop()) for player in players]

    def is_over(self) -> bool:
        """Go on where an answer has come; tell whether all is done, or the time is over."""
        late = time.monotonic() > self._until_s
        for one in self._led:
            one.go_on()
        if not late and any(one.result is None for one in self._led):
            return False
        self._answer([one.end() for one in self._led])
        return True


class _Led:
    """One reference generator on its way through the steps."""

    def __init__(self, node: Node, player: str, steps: Steps) -> None:
        self._node, self._player, self._steps = node, player, steps
        self._clients = {name: node.create_client(kind, f'{player}/{name}')
                         for name, kind in SERVICES.items()}
        self._future: Any = None
        self.result: dict[str, Any] | None = None
        self._next = self._take(None)

    def _take(self, response: Any) -> tuple[str, Any] | None:
        """Return the next call, None at the end."""
        try:
            return self._steps.send(response)
        except StopIteration as ended:
            self._finish(True, str(ended.value))
        except Refused as why:
            self._finish(False, str(why))
        return None

    def _finish(self, ok: bool, message: str) -> None:
        self.result = {'node': self._player, 'ok': ok, 'message': message}

    def go_on(self) -> None:
        """Call what is next, or take the answer that has come."""
        if self._future is not None and self._future.done():
            response, self._future = self._future.result(), None
            self._next = self._take(response)
        if self._future is None and self._next is not None:
            service, request = self._next
            if self._clients[service].service_is_ready():
                self._future = self._clients[service].call_async(request)

    def end(self) -> dict[str, Any]:
        """Return the result, and leave the services."""
        for client in self._clients.values():
            self._node.destroy_client(client)
        return self.result or {'node': self._player, 'ok': False,
                               'message': f'no answer within {LONGEST_S:g} s'}
