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
this one. It speaks only while the driver is silent, and says nothing but the safe signal.
"""

from pam_actuation.messages import SAFE_EFFORTS, VALVE_NAMES, valve_of, ValveSignal

WAITING, HEARS, RESTS, VENTS = (
    'waiting for the first valve signal', 'hears the driver',
    'the driver ended with the signal that vents',
    'vented because the valve signal fell silent: driver killed or stopped')


class SignalWatchdog:
    """
    Listen to ``valve_signal``, where its own messages arrive as well.

    Attributes
    ----------
    state : str
        One of ``WAITING``, ``HEARS``, ``RESTS``, ``VENTS``.
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

    """

    def __init__(self, valve_type, timeout_s):
        self.state = WAITING
        self.vents = 0
        self.valve_type = valve_type
        self._timeout_ns = round(timeout_s * 1e9)
        self._heard_ns = None
        self._last = None
        self._own_stamps = set()

    def on_signal(self, message, now_ns):
        """Take a ValveSignal that was on the topic at a time; its own do not count."""
        if message.stamp_ns in self._own_stamps:
            self._own_stamps.discard(message.stamp_ns)
            return
        self._heard_ns, self._last = now_ns, message
        # A signal for the other valve would vent nothing, whatever this one was told.
        self.valve_type = valve_of(message.names) or self.valve_type

    def tick(self, now_ns):
        """Return the safe ValveSignal to send, None while there is nothing to say."""
        if self._heard_ns is None:
            return None
        if now_ns - self._heard_ns <= self._timeout_ns:
            self.state = HEARS
            return None
        if self.state != VENTS and self._vented():
            self.state = RESTS
            return None
        if self.state != VENTS:
            self.vents += 1
        self.state = VENTS
        self._own_stamps.add(now_ns)
        return ValveSignal(now_ns, VALVE_NAMES[self.valve_type], SAFE_EFFORTS[self.valve_type])

    def _vented(self):
        """Tell whether the last signal heard is the safe one."""
        efforts = dict(zip(self._last.names, self._last.efforts))
        return SAFE_EFFORTS[self.valve_type] == tuple(
            efforts.get(name) for name in VALVE_NAMES[self.valve_type])
