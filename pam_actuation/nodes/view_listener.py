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

"""What the live page hears of a rig, and how it asks the drivers to vent."""

from collections.abc import Iterator
import queue
import time
from typing import Any, Final

from pam_actuation.bags.series import table
from pam_actuation.nodes.endpoints import PolledSubscription
from pam_actuation.nodes.onlooker import Onlooker
from pam_actuation.nodes.operator import is_below, serving
from pam_actuation.nodes.view_marking import Marking
from pam_actuation.nodes.view_player import experiments, PLAYER, Playing
from pam_actuation.topics.codec import Reader
from pam_actuation.topics.table import DIAGNOSTICS, MARKER, RECORDER, short_name
from pam_actuation.view.plots import KEPT
from pam_actuation.view.requests import ACTIONS, EMERGENCY_STOP, MARK, PLAY, Request
from pam_actuation.view.source import Answer
from pam_actuation.view.store import Store
from std_srvs.srv import Trigger

POLL_S, LOOK_S = 0.02, 1.0          # for messages; for new topics and drivers
ANSWER_S: Final = 2.0               # a driver answers within a tick; later it is told as silent


class ViewListener(Onlooker):
    """
    A source of the page: the rigs of a ROS domain.

    Parameters
    ----------
    domain_id, namespace
        As of ``Onlooker``.

    """

    live = True
    remarks: tuple[str, ...] = ()

    def __init__(self, domain_id: int | None = None, namespace: str = '') -> None:
        super().__init__(domain_id, namespace)
        self.title = namespace
        self.store = Store()
        self._read, self._read_marker = Reader(short_name(DIAGNOSTICS)), Reader(MARKER)
        self._marking = Marking(self._node, self.store)
        self._clients: dict[str, dict[str, Any]] = {}       # driver: action: client
        self._players: list[str] = []
        self._asked: queue.SimpleQueue[tuple[Request, Answer]] = queue.SimpleQueue()
        self._waiting: list[_Question | Playing] = []
        self._look_at_s = 0.0

    def drivers(self) -> list[str]:
        """Return the full names of the nodes that can be asked to vent."""
        return sorted(self._clients)

    def players(self) -> list[str]:
        """Return the full names of the reference generators; not of a rig that is recorded."""
        return self._players

    def experiments(self) -> list[str]:
        """Return the names of the experiments that come with the package."""
        return experiments()

    def act(self, request: Request, answer: Answer) -> None:
        """Do what a page asks for; ``answer`` is called from the thread of ``run_once``."""
        self._asked.put((request, answer))

    def run_once(self) -> None:
        """Take what has arrived, and wait a little; to be called again and again."""
        now_s = time.monotonic()
        if now_s >= self._look_at_s:
            self._look_at_s = now_s + LOOK_S
            self._look()
        for full_name, subscription in self._topics.items():
            self._take(full_name, subscription)
        while not self._asked.empty():
            self._begin(*self._asked.get())
        self._waiting = [one for one in self._waiting if not one.is_over()]
        self.spin_until(now_s + POLL_S)

    def _begin(self, request: Request, answer: Answer) -> None:
        """Ask those whom a request is for."""
        if request.do == MARK:
            answer(self._marking.mark(request.view, request.text))
            return
        if request.do in ACTIONS:
            drivers: list[str] | None = None
            if request.do == EMERGENCY_STOP:
                self._find_drivers()        # those that came since
            else:
                drivers = [one for one in self._clients if is_below(one, request.view)]
            self._waiting.append(_Question(self._clients, request.do, drivers, answer))
            return
        wanted = request.experiment
        players = [one for one in self._players if one.startswith(f'{request.view}/')]
        if request.do == PLAY and wanted not in experiments():
            answer([{'node': one, 'ok': False, 'message': f'no experiment is called {wanted!r}'}
                    for one in players])
            return
        self._waiting.append(Playing(self._node, players, wanted, answer))

    def _look(self) -> None:
        """Find topics and drivers that came, forget drivers that went."""
        self.find_topics((*KEPT, MARKER))
        self._marking.look()
        self._players = sorted(self._found_players())
        self._find_drivers()

    def _find_drivers(self) -> None:
        """Find drivers that came, forget drivers that went."""
        found = set(serving(self._node, self._namespace, EMERGENCY_STOP))
        for driver in self._clients.keys() - found:
            for client in self._clients.pop(driver).values():
                self._node.destroy_client(client)
        for driver in found - self._clients.keys():
            self._clients[driver] = {
                action: self._node.create_client(Trigger, f'{driver}/{action}')
                for action in ACTIONS}

    def _found_players(self) -> Iterator[str]:
        """Yield reference generators that are not recorded: a bag tells of one experiment."""
        nodes = self._node.get_node_names_and_namespaces()
        recorded = [namespace for name, namespace in nodes if name == RECORDER]
        for name, namespace in nodes:
            full_name = f'{namespace.rstrip("/")}/{name}'
            if name == PLAYER and is_below(full_name, self._namespace) and (
                    namespace not in recorded):
                yield full_name

    def _take(self, full_name: str, subscription: PolledSubscription) -> None:
        raws = [raw for raw, _ in subscription.take()]
        if not raws:
            return
        if full_name == DIAGNOSTICS:
            for raw in raws:
                self.store.add_statuses(
                    status for status in self._read(raw) or ()
                    # Other programs name what they tell without a slash before it.
                    if not self._namespace or is_below(status.name, self._namespace))
            return
        namespace, _, short = full_name.rpartition('/')
        if short == MARKER:
            self.store.add_markers(namespace, filter(None, map(self._read_marker, raws)))
            return
        stamps_ns, values, bad = table(short, raws, KEPT[short])
        if bad.any():
            stamps_ns = stamps_ns[~bad]
            values = {name: column[~bad] for name, column in values.items()}
        self.store.add(namespace, short, stamps_ns, values, subscription.lost)


class _Question:
    """
    An action that some drivers were asked for.

    A driver is asked as soon as its service is there. Without a list of drivers all are asked,
    also those that come before the last answer.
    """

    def __init__(self, clients: dict[str, dict[str, Any]], action: str,
                 drivers: list[str] | None, answer: Answer) -> None:
        self._clients, self._action, self._all = clients, action, drivers is None
        self._answer, self._until_s = answer, time.monotonic() + ANSWER_S
        # What a driver will say; None: it is not asked yet.
        self._futures: dict[str, Any] = dict.fromkeys(drivers or ())

    def _ask(self) -> None:
        """Ask those who can be asked by now."""
        for driver, of_driver in self._clients.items():
            wanted = self._all or driver in self._futures
            if wanted and self._futures.get(driver) is None:
                client = of_driver[self._action]
                self._futures[driver] = (
                    client.call_async(Trigger.Request()) if client.service_is_ready() else None)

    def is_over(self) -> bool:
        """Ask, and tell whether all have answered or the time is over; hand on what they said."""
        late = time.monotonic() > self._until_s
        if not late:
            self._ask()
        if not late and not all(
                future is not None and future.done() for future in self._futures.values()):
            return False
        self._answer([_result(driver, future) for driver, future in self._futures.items()])
        return True


def _result(driver: str, future: Any) -> dict[str, Any]:
    """Return what a driver answered, or that it did not."""
    if future is None or not future.done():
        return {'node': driver, 'ok': False, 'message': f'no answer within {ANSWER_S:g} s'}
    response = future.result()
    return {'node': driver, 'ok': bool(response.success), 'message': response.message}
