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

"""The reference loop: what goes on the wire, and when."""

from pam_actuation.experiments import load_experiment, ReferenceLoop
import pytest

T0 = 1_700_000_000_000_000_000


def run(name, seconds, **options):
    """Collect (now, messages) of a reference loop at 100 Hz."""
    loop = ReferenceLoop(load_experiment(name), **options)
    period = 10_000_000
    return loop, [(T0 + k * period, loop.tick(T0 + k * period))
                  for k in range(int(seconds * 100))]


def test_trajectory_keeps_the_rules_of_the_wire():
    _, ticks = run('sine_quarter_hz', 8)
    sent = [(now, m['reference_trajectory']) for now, m in ticks if 'reference_trajectory' in m]
    gaps = [b[0] - a[0] for a, b in zip(sent, sent[1:])]
    assert max(gaps) <= 200_000_000                                  # at least 5 Hz
    for now, message in sent:
        offsets = message.time_from_start_ns
        assert message.stamp_ns == now
        assert max(b - a for a, b in zip(offsets, offsets[1:])) <= 20_000_000
        assert offsets[-1] - offsets[0] >= 500_000_000


def test_late_ticks_do_not_move_the_points_of_the_trajectory():
    loop = ReferenceLoop(load_experiment('step_10mm'))
    jumps = set()
    for tick in range(530):
        late_ns = 7_654_321 * tick % 9_000_000
        now_ns = T0 + tick * 10_000_000 + late_ns
        message = loop.tick(now_ns).get('reference_trajectory')
        if message is not None:
            times = [message.stamp_ns + o for o in message.time_from_start_ns]
            assert 0 <= now_ns - message.stamp_ns < 20_000_000
            assert {(t - T0) % 20_000_000 for t in times} == {0}
            assert times[-1] - now_ns >= 500_000_000
            x = message.contraction_m
            jumps |= {times[k + 1] for k in range(len(x) - 1) if x[k + 1] - x[k] > 5e-3}
    assert jumps == {T0 + 5_000_000_000}


def test_trajectory_announces_the_later_reference():
    _, ticks = run('sine_quarter_hz', 8)
    later = {now: m['reference'].contraction_m for now, m in ticks}
    for now, messages in ticks:
        message = messages.get('reference_trajectory')
        if message is None:
            continue
        for offset, value in zip(message.time_from_start_ns, message.contraction_m):
            if now + offset in later:
                assert value == later[now + offset]


@pytest.mark.parametrize('preview_s', [0.0, 0.019])
def test_without_preview_nothing_is_announced(preview_s):
    loop, ticks = run('sine_quarter_hz', 2, preview_s=preview_s)
    assert loop.topics == ('reference',)
    assert all(set(messages) == {'reference'} for _, messages in ticks)


@pytest.mark.parametrize('preview_s', [0.02, 0.1, 0.25])
def test_a_preview_is_known_that_long_at_each_tick_and_no_longer(preview_s):
    loop, ticks = run('step_10mm', 6, preview_s=preview_s)
    assert loop.topics == ('reference', 'reference_trajectory')
    first_ns = None
    for now, messages in ticks:
        message = messages['reference_trajectory']
        ahead_s = (message.stamp_ns + message.time_from_start_ns[-1] - now) * 1e-9
        assert preview_s - 0.02 < ahead_s <= preview_s + 1e-9
        if first_ns is None and max(message.contraction_m) > message.contraction_m[0] + 5e-3:
            first_ns = now
    assert 5.0 - preview_s <= (first_ns - T0) * 1e-9 <= 5.0 - preview_s + 0.02


def test_a_long_preview_is_the_usual_one():
    _, ticks = run('sine_quarter_hz', 3)
    for preview_s in (0.6, 10.0, None):
        assert run('sine_quarter_hz', 3, preview_s=preview_s)[1] == ticks


def test_pressure_experiments_command_pressure():
    _, ticks = run('pressure_identification', 2)
    assert all(set(m) == {'pressure_command'} for _, m in ticks)
    assert ticks[150][1]['pressure_command'].pressure_pa == 401325.0


def test_finishes_after_its_duration():
    loop, ticks = run('short_sine', 6.5)
    assert not loop.finished(T0 + int(5.9e9))
    assert loop.finished(T0 + int(6.0e9))
