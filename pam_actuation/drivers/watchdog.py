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
The last word when the driver has none: vent once its valve signal falls silent.

For a process of its own, beside the driver: what kills or stops that one does not reach
this one. It speaks only while the driver is silent or a second sender drives the valve, and
says nothing but the safe signal.
"""

from collections.abc import Callable, Hashable
import os

from pam_actuation.drivers.senders import CLEAR_S, is_safe, told, UNNAMED_S
from pam_actuation.messages import SAFE_EFFORTS, VALVE_NAMES, valve_of, ValveSignal
from pam_sim.units import NS_PER_S

WAITING, HEARS, RESTS, VENTS, CONTESTED = (
    'waiting for the first valve signal', 'hears the driver',
    'the driver ended with the signal that vents',
    'vented because the valve signal fell silent', 'vented because two send the valve signal')
_MS = 1_000_000
_LATE_NS = 20_000_000           # between two of its own ticks: it was kept waiting itself


class _Other:
    """A writer that is not the driver's."""

    def __init__(self, now_ns: int) -> None:
        self.first_ns = self.last_ns = now_ns
        self.name = ''
        self.spoke = False          # with a name, or with an opening

    def counts(self, now_ns: int) -> bool:
        """Tell whether it was heard lately, and is not just a node whose name is on its way."""
        lately = 0 <= now_ns - self.last_ns <= CLEAR_S * NS_PER_S
        return lately and (self.spoke or now_ns - self.first_ns >= UNNAMED_S * NS_PER_S)


class SignalWatchdog:
    """
    Listen to ``valve_signal``, where its own messages arrive as well.

    The driver is the first that was heard. A node of the same name takes its place once it is
    silent, as after a restart; another one where it ended in order before that one began. Who
    else speaks is a second sender: the valve is vented until it is silent for 1 s.

    Times [ns] are those of a clock that nobody sets: once it was set back, a driver that died
    would seem to be heard from the future. Only the stamps of messages are of another clock.

    Attributes
    ----------
    state : str
        One of ``WAITING``, ``HEARS``, ``RESTS``, ``VENTS``, ``CONTESTED``.
    vents : int
        How often it has vented.
    valve_type : {'ppr', 'hsv'}
        The valve for which it speaks: that of the driver it heard last.

    Parameters
    ----------
    valve_type : {'ppr', 'hsv'}
        Assumed until the driver is heard.
    timeout_s : float
        Silence [s] from which it vents.
    name : str
        Full name of its node; safe signals of a namesake do not count.
    load : callable
        Returns what is known of the load of the machine, as words.
    driver : str
        Full name of the rig's driver, which takes its place also from another one.

    """

    def __init__(self, valve_type: str, timeout_s: float, name: str = '',
                 load: Callable[[], str] = lambda: '', driver: str = '') -> None:
        self.state = WAITING
        self.vents = 0
        self.valve_type = valve_type
        self._timeout_ns = round(timeout_s * 1e9)
        self._name, self._load, self._expected = name, load, driver
        self._heard_ns = 0          # the newest signal of the driver
        self._last: ValveSignal | None = None
        self._own_stamps: set[int] = set()
        self._driver: Hashable = None
        self._driver_name = ''
        self._others: dict[Hashable, _Other] = {}          # by writer
        self._former: set[Hashable] = set()     # writers of drivers that were replaced
        self._ticked_ns: int | None = None
        self._late_ns = 0, 0        # longest time between two ticks lately, and when it ended
        self._why = ''
        self._silent_ms = 0

    def on_signal(self, message: ValveSignal, now_ns: int, writer: Hashable = None,
                  name: str = '') -> bool:
        """
        Take a ValveSignal that was on the topic at a time; its own do not count.

        ``writer`` is the GID of its writer, None where that is not known; ``name`` the full
        name of its node, '' while that is not known. Returns whether it is the opening of a
        second sender.
        """
        if message.stamp_ns in self._own_stamps:
            self._own_stamps.discard(message.stamp_ns)
            return False
        safe = is_safe(message)
        if safe and name and name == self._name:
            return False
        if not self._is_driver(writer, name, now_ns):
            other = self._others[writer]
            other.last_ns, other.name = now_ns, name
            other.spoke |= bool(name) or not safe
            return not safe
        self._heard_ns, self._last = now_ns, message
        # A signal for the other valve would vent nothing, whatever this one was told.
        self.valve_type = valve_of(message.names) or self.valve_type
        return False

    def _is_driver(self, writer: Hashable, name: str, now_ns: int) -> bool:
        """Tell whether a message is the driver's; let a writer take its place if it may."""
        if writer is None or writer == self._driver:
            self._driver_name = name or self._driver_name
            return True
        if self._driver is None:
            self._driver, self._driver_name = writer, name
            return True
        self._others = {one: other for one, other in self._others.items()
                        if 0 <= now_ns - other.last_ns <= CLEAR_S * NS_PER_S}
        first_ns = self._others.setdefault(writer, _Other(now_ns)).first_ns
        silent_ns = now_ns - self._heard_ns
        began_after = writer not in self._former and self._heard_ns < first_ns
        same = name and name in (self._driver_name, self._expected)
        if same and (began_after or silent_ns > CLEAR_S * NS_PER_S) or (
                began_after and silent_ns > self._timeout_ns and self.state in (HEARS, RESTS)
                and self._ended_in_order()):
            self._former.add(self._driver)
            del self._others[writer]
            self._driver, self._driver_name = writer, name
            return True
        return False

    def tick(self, now_ns: int, stamp_ns: int | None = None) -> ValveSignal | None:
        """
        Return the safe ValveSignal to send, None while there is nothing to say.

        ``stamp_ns`` is its stamp, where that is of another clock.
        """
        if not self._speaks(now_ns):
            return None
        return self.safe_signal(now_ns if stamp_ns is None else stamp_ns)

    def _speaks(self, now_ns: int) -> bool:
        self._note_delay(now_ns)
        foreign = [one.name for one in self._others.values() if one.counts(now_ns)]
        if foreign:
            self._why = f'valve_signal is sent by {told([self._driver_name, *foreign])}'
            return self._vent(now_ns, CONTESTED)
        if self._last is None:
            return False
        silent_ns = now_ns - self._heard_ns
        if silent_ns <= self._timeout_ns:
            self.state = HEARS
            return False
        if self.state not in (VENTS, CONTESTED) and self._ended_in_order():
            self.state = RESTS
            return False
        if self.state != VENTS:
            self._why = (f'(limit {self._timeout_ns * 1e-6:.0f} ms): driver killed or stopped, '
                         f'or the machine too busy{self._known_of_load(now_ns)}')
        return self._vent(now_ns, VENTS)

    def _vent(self, now_ns: int, state: str) -> bool:
        if self.state not in (VENTS, CONTESTED):
            self.vents += 1
        silent_ns = now_ns - self._heard_ns
        # A figure that changes with every tick would be a flood of messages.
        if self.state != state or silent_ns >= NS_PER_S:
            self._silent_ms = (
                silent_ns // _MS if silent_ns < NS_PER_S else silent_ns // NS_PER_S * 1000)
        self.state = state
        return True

    def safe_signal(self, stamp_ns: int) -> ValveSignal:
        """Return the ValveSignal that vents, to be sent now."""
        self._own_stamps.add(stamp_ns)
        return ValveSignal(stamp_ns, VALVE_NAMES[self.valve_type], SAFE_EFFORTS[self.valve_type])

    @property
    def text(self) -> str:
        """Return the state as a sentence, with what is known of the reason."""
        if self.state == CONTESTED:
            return f'{CONTESTED}: {self._why}, stop all but the driver'
        if self.state != VENTS:
            return self.state
        return f'{VENTS} for {self._silent_ms} ms {self._why}'

    def _note_delay(self, now_ns: int) -> None:
        before_ns, self._ticked_ns = self._ticked_ns, now_ns
        longest_ns, since_ns = self._late_ns
        if not 0 <= now_ns - since_ns <= NS_PER_S:
            longest_ns = 0
        if before_ns is not None and now_ns - before_ns >= max(longest_ns, _LATE_NS):
            self._late_ns = now_ns - before_ns, now_ns
        elif not longest_ns:
            self._late_ns = 0, now_ns

    def _known_of_load(self, now_ns: int) -> str:
        known = [self._load()]
        if self._late_ns[0]:
            known.append(f'this watchdog itself waited {self._late_ns[0] * 1e-6:.0f} ms for the '
                         'processor')
        words = ', '.join(filter(None, known))
        return words and f' ({words})'

    def _ended_in_order(self) -> bool:
        """Tell whether the last signal heard is the safe one."""
        return self._last is not None and is_safe(self._last)


def machine_load() -> str:
    """Return what the system tells of its load, as words."""
    try:
        return f'load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores'
    except OSError:
        return ''
