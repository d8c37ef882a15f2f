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

"""How loops hang on the bus."""

from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.loops.bus import Bus
from pam_actuation.loops.wiring import driver_tick
import pytest


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_a_driver_sends_signal_and_followed_pressure_before_its_status_is_asked_for(valve):
    # A recorder writes messages of one time in the order in which they come.
    order = []
    bus = Bus(on_sent=lambda topic, message, now_ns: order.append(topic))
    driver = DriverLoop(valve)
    tick = driver_tick(
        bus, driver, 'left/', lambda now_ns: order.append(driver.status().stamp_ns - now_ns))
    for k in range(2):
        tick(k * 10_000_000)
    assert order == ['left/valve_signal', 'left/followed_pressure', 0] * 2
