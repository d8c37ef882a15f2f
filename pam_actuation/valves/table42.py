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

"""Each statement of the chapter's Table 4.2 beside what was measured."""

from typing import Any

from pam_actuation.valves.compare import TITLES

SUPPORTED, NOT_SUPPORTED = 'supported', 'not supported'
INDIRECT = 'indirect'           # what was measured speaks for it, the thing itself is no output
GIVEN = 'as given'              # a property of the goods, quoted from the chapter

STATEMENT_HEAD = ('valve', 'Table 4.2 says', 'simulation', 'measured')


def statements(result: dict[str, Any]) -> list[dict[str, str]]:
    """
    Return the statements of Table 4.2 in its order.

    Parameters
    ----------
    result : dict
        As of ``compare.compare``.

    Returns
    -------
    list of dict
        ``valve``, ``side`` (advantage or disadvantage), ``statement``, ``measured``
        (one sentence with the numbers) and ``verdict``.

    """
    ppr, hsv = result['valves']['ppr'], result['valves']['hsv switching']
    return [{'valve': valve, 'side': side, 'statement': statement, 'verdict': verdict,
             'measured': measured}
            for valve, side, statement, (verdict, measured) in (
                ('PPR', 'advantage', 'Linear flow', _linear(ppr, hsv)),
                ('PPR', 'advantage', 'Easy to control', _easy(ppr, hsv)),
                ('PPR', 'advantage', 'Quiet', _quiet(ppr, hsv)),
                ('PPR', 'advantage', 'Pressure falls to zero if power loss', _falls(ppr, hsv)),
                ('PPR', 'disadvantage', 'Expensive', (
                    GIVEN, 'five times the cost of an on/off valve; not simulated')),
                ('PPR', 'disadvantage', 'Bulky (0.915 kg)', (
                    GIVEN, '0.915 kg against 0.06 kg, about 15 times; not simulated')),
                ('PPR', 'disadvantage', 'Heavy', (GIVEN, '0.915 kg; not simulated')),
                ('PPR', 'disadvantage', 'Constant control signal required',
                 _constant(ppr, result)),
                ('HSV', 'advantage', 'Relatively small (0.06 kg)', (
                    GIVEN, '0.06 kg for one valve, a pair has two; not simulated')),
                ('HSV', 'advantage', 'Inexpensive (1/5 cost of PPR)', (
                    GIVEN, 'one fifth of the cost of a regulator; not simulated')),
                ('HSV', 'advantage', 'Valve can be shut after set point is reached',
                 _shut(hsv, result)),
                ('HSV', 'disadvantage', 'High initial switching current', (
                    GIVEN, f'{result["power"]["hsv_peak_power_w"]:g} W for '
                    f'{result["power"]["hsv_peak_time_s"] * 1e3:g} ms, then '
                    f'{result["power"]["hsv_hold_power_w"]:g} W: assumed, not simulated')),
                ('HSV', 'disadvantage', 'Noisy', _noisy(ppr, hsv)),
                ('HSV', 'disadvantage', 'Electromagnetic noise from switching', (
                    INDIRECT, f'{hsv["moving"]["pulses_per_s"]:.0f} coil pulses per second '
                    'while moving; fields are not simulated')))]


def statement_rows(result: dict[str, Any]) -> list[tuple[str, str, str, str]]:
    """Return the rows under :data:`STATEMENT_HEAD`."""
    return [(item['valve'], item['statement'], item['verdict'], item['measured'])
            for item in statements(result)]


def _verdict(holds: bool, word: str = SUPPORTED) -> str:
    return word if holds else NOT_SUPPORTED


def _linear(ppr: dict[str, Any], hsv: dict[str, Any]) -> tuple[str, str]:
    ours, theirs = ppr['flow']['ratio'], hsv['flow']['ratio']
    return _verdict(ours < 1.05 < theirs), (
        f'the effect of the same signal varies by a factor {ours:.2f} between 100 and 500 kPa '
        f'(HSV: {theirs:.1f}); {100.0 * ppr["accuracy"]["line_deviation"]:.3f} % of span off a '
        'straight line')


def _easy(ppr: dict[str, Any], hsv: dict[str, Any]) -> tuple[str, str]:
    ours, theirs = ppr['accuracy'], hsv['accuracy']
    holds = (ours['steady_error_max_pa'] <= theirs['steady_error_max_pa']
             and ppr['response']['overshoot_worst'] <= hsv['response']['overshoot_worst'])
    return _verdict(holds), (
        f'{_kpa(ours["steady_error_max_pa"])} worst steady error, '
        f'{100.0 * ppr["response"]["overshoot_worst"]:.1f} % overshoot without a loop outside '
        f'the valve (HSV, with one: {_kpa(theirs["steady_error_max_pa"])}, '
        f'{100.0 * hsv["response"]["overshoot_worst"]:.1f} %)')


def _quiet(ppr: dict[str, Any], hsv: dict[str, Any]) -> tuple[str, str]:
    quieter = (ppr['accuracy']['ripple_moving_rms_pa'] < hsv['accuracy']['ripple_moving_rms_pa']
               and ppr['moving']['pulses_per_s'] < hsv['moving']['pulses_per_s'])
    return _verdict(quieter, INDIRECT), (
        f'no switching; pressure ripple while moving '
        f'{_kpa(ppr["accuracy"]["ripple_moving_rms_pa"])} rms '
        f'(HSV: {_kpa(hsv["accuracy"]["ripple_moving_rms_pa"])}); sound is not simulated')


def _falls(ppr: dict[str, Any], hsv: dict[str, Any]) -> tuple[str, str]:
    off, shut, vented = ppr['power_loss']['off'], hsv['power_loss']['off'], \
        hsv['power_loss']['vented']
    return _verdict(off['gauge_after_pa'] < 1e3), (
        f'from 400 kPa to 10 % in {_seconds(off["to_ten_percent_s"])}, '
        f'{_kpa(off["gauge_after_pa"])} after {off["after_s"]:g} s '
        f'(HSV shut: {_kpa(shut["gauge_after_pa"])}; with a vent valve open without power: '
        f'{_seconds(vented["to_ten_percent_s"])})')


def _constant(ppr: dict[str, Any], result: dict[str, Any]) -> tuple[str, str]:
    hold = ppr['hold']
    return _verdict(hold['energised_share'] == 1.0 and hold['signal_mean'] > 0.0), (
        f'{hold["signal_mean"]:.2f} V all the time while holding; '
        f'{hold["power_w"]:g} W, {hold["power_w"] * result["hold_s"]:.0f} J in '
        f'{result["hold_s"]:g} s (power assumed)')


def _shut(hsv: dict[str, Any], result: dict[str, Any]) -> tuple[str, str]:
    hold, leak = hsv['hold'], hsv['hold_leaking']
    return _verdict(hold['shut_share'] > 0.95), (
        f'both shut {100.0 * hold["shut_share"]:.1f} % of {result["hold_s"]:g} s, '
        f'{hold["power_w"]:.3f} W, at most {_kpa(hold["error_max_pa"])} off (with a leak '
        f'{100.0 * leak["shut_share"]:.1f} %, {leak["power_w"]:.3f} W, '
        f'{_kpa(leak["error_max_pa"])})')


def _noisy(ppr: dict[str, Any], hsv: dict[str, Any]) -> tuple[str, str]:
    noisier = (hsv['accuracy']['ripple_moving_rms_pa'] > ppr['accuracy']['ripple_moving_rms_pa']
               and hsv['moving']['pulses_per_s'] > 0.0)
    return _verdict(noisier, INDIRECT), (
        f'{hsv["moving"]["pulses_per_s"]:.0f} pulses per second while moving, '
        f'{hsv["hold"]["pulses_per_s"]:.1f} at rest, {hsv["hold_leaking"]["pulses_per_s"]:.1f} '
        f'holding against a leak; pressure ripple while moving '
        f'{_kpa(hsv["accuracy"]["ripple_moving_peak_to_peak_pa"])} peak to peak')


NUMBERS = (
    ('steady error, mean', 'kPa', 1e-3, 3, 'accuracy', 'steady_error_mean_pa'),
    ('steady error, worst', 'kPa', 1e-3, 3, 'accuracy', 'steady_error_max_pa'),
    ('tracking RMSE, ±100 kPa at 0.5 Hz', 'kPa', 1e-3, 2, 'accuracy', 'tracking_rmse_pa'),
    ('gain of pressure to command', '-', 1.0, 4, 'accuracy', 'line_gain'),
    ('off the straight line, worst', '% of span', 100.0, 3, 'accuracy', 'line_deviation'),
    ('difference up and down, worst', 'kPa', 1e-3, 3, 'accuracy', 'up_down_difference_pa'),
    ('open loop: largest to smallest effect', '-', 1.0, 2, 'flow', 'ratio'),
    ('dead time to 2 %, filling', 'ms', 1e3, 1, 'response', 'fill_dead_time_s'),
    ('dead time to 2 %, venting', 'ms', 1e3, 1, 'response', 'vent_dead_time_s'),
    ('rise 10 to 90 %, filling', 'ms', 1e3, 0, 'response', 'fill_rise_s'),
    ('fall 10 to 90 %, venting', 'ms', 1e3, 0, 'response', 'vent_rise_s'),
    ('settling, mean of filling', 'ms', 1e3, 0, 'response', 'fill_settling_s'),
    ('settling, mean of venting', 'ms', 1e3, 0, 'response', 'vent_settling_s'),
    ('overshoot, worst', '%', 100.0, 1, 'response', 'overshoot_worst'),
    ('bandwidth (−3 dB), ±20 kPa', 'Hz', 1.0, 1, 'small_sines', 'bandwidth_hz'),
    ('air of a cycle 100–500–100 kPa', 'mg', 1e6, 1, 'cycle', 'air_kg'),
    ('the same, normal litres', 'l', 1.0, 4, 'cycle', 'air_normal_l'),
    ('air while holding', 'mg', 1e6, 2, 'hold', 'air_kg'),
    ('air while holding, leaking', 'mg', 1e6, 2, 'hold_leaking', 'air_kg'),
    ('ripple while holding, rms', 'Pa', 1.0, 2, 'hold', 'ripple_rms_pa'),
    ('ripple while holding, leaking, rms', 'Pa', 1.0, 0, 'hold_leaking', 'ripple_rms_pa'),
    ('the same, peak to peak', 'Pa', 1.0, 0, 'hold_leaking', 'ripple_peak_to_peak_pa'),
    ('ripple while moving, rms', 'Pa', 1.0, 0, 'accuracy', 'ripple_moving_rms_pa'),
    ('the same, peak to peak', 'Pa', 1.0, 0, 'accuracy', 'ripple_moving_peak_to_peak_pa'),
    ('contraction ripple, holding, leaking, rms', 'µm', 1e6, 2, 'hold_leaking',
     'contraction_ripple_rms_m'),
    ('pulses per second, moving', '1/s', 1.0, 1, 'moving', 'pulses_per_s'),
    ('pulses per second, holding', '1/s', 1.0, 1, 'hold', 'pulses_per_s'),
    ('pulses per second, holding, leaking', '1/s', 1.0, 1, 'hold_leaking', 'pulses_per_s'),
    ('power while moving', 'W', 1.0, 3, 'moving', 'power_w'),
    ('power while holding', 'W', 1.0, 3, 'hold', 'power_w'),
    ('power while holding, leaking', 'W', 1.0, 3, 'hold_leaking', 'power_w'),
)


def number_head() -> tuple[str, ...]:
    """Return the head of the table of numbers."""
    return ('quantity', 'unit', *TITLES.values())


def number_rows(result: dict[str, Any]) -> list[tuple[str, ...]]:
    """Return the rows under :func:`number_head`; a dash where it did not settle."""
    rows = []
    for label, unit, scale, digits, part, key in NUMBERS:
        cells = []
        for name in TITLES:
            found = result['valves'][name][part]
            if found[key] is not None:
                cells.append(f'{found[key] * scale:.{digits}f}')
            else:
                beyond = found.get('frequencies_hz')
                cells.append(f'> {beyond[-1]:g}' if beyond else '–')
        rows.append((label, unit, *cells))
    for label, case in (('power off: to 10 %', 'off'),
                        ('power off, vent open: to 10 %', 'vented')):
        cells = []
        for name in TITLES:
            found = result['valves'][name]['power_loss'].get(case)
            cells.append('–' if found is None else 'holds' if found['to_ten_percent_s'] is None
                         else f'{found["to_ten_percent_s"] * 1e3:.0f}')
        rows.append((label, 'ms', *cells))
    return rows


def notes(result: dict[str, Any]) -> list[str]:
    """Return the sentences that say what the numbers rest on."""
    power = ', '.join(f'{name} {value:g}' for name, value in result['power'].items())
    effects = ', '.join(result['effects']) or 'none'
    return [
        f'Rig {result["rig"]}, load {result["load"]}, effects: {effects}; seed '
        f'{result["seed"]}. Same muscle, same commands, each valve with its own driver.',
        'These are numbers of the model, not of a device: the regulator has no error at rest '
        'unless the rig has valve_dead_zone or valve_hysteresis (half_width_pa), and what it '
        'bleeds for itself is not modelled.',
        f'Holds are of {result["hold_s"]:g} s at {result["hold_gauge_pa"] / 1e3:g} kPa; '
        '"leaking" adds the effect leakage of its nominal size. Ripple at rest is what is '
        'faster than 1 s, in motion faster than 20 ms.',
        f'Electrical power is not simulated but counted with {power}: design values unless '
        'given with --power. Mass and cost are as given by the chapter.',
    ]


def _kpa(value: float) -> str:
    return f'{value / 1e3:.2f} kPa'


def _seconds(value: float) -> str:
    return 'never' if value is None else f'{value:.2f} s'
