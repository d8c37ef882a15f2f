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

"""The pages: complete, self-contained, small, safe against odd names."""

from dataclasses import replace
import json
import re
from types import SimpleNamespace

import numpy as np
from pam_actuation.control.sofc.rule_table import linear_feedback_table, RuleBase
from pam_actuation.report import demo_page, figures, page, pages
from pam_actuation.report.sections.over_seeds import same_remarks
from pam_actuation.report.sections.replay import Overlay
from pam_actuation.report.sections.rules import rules as rules_section
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.files import write_text
from pam_sim.gap.result import Calibrated, GapResult, SignalGap, Trace
from pam_sim.gap.share import Share
from pam_sim.run import Series
import pytest
from tracking_runs import step_run, tracking_run

AMPLITUDES = 2e-3 * 0.7 ** np.arange(5)
METADATA = {'experiment_name': 'sine <script>alert(1)</script>', 'valve': 'ppr', 'seed': '7',
            'software_version': '0.0', 'controller': 'kind: sofc'}


def markup(path):
    """Return the page without its scripts, and the figures in it."""
    content = path.read_text(encoding='utf-8')
    data = re.findall(r'<script type="application/json">(.*?)</script>', content, re.S)
    return re.sub(r'<script.*?</script>', '', content, flags=re.S), [json.loads(d) for d in data]


def rules():
    """Return (before, after) rule bases, the second with something learned."""
    scaling = {'feedback_gain_pa': 6e3, 'error_universe_m': 2e-3,
               'change_universe_m_per_s': 0.04, 'reference_lower_m': 0.0,
               'reference_upper_m': 0.03}
    before = RuleBase(linear_feedback_table(), np.zeros((2, 25)), scaling)
    after = before.copy()
    after.feedforward[0] += 5e3
    after.feedback[1, 3, 3] = 0.7
    after.feedback_fired += 2.0
    return before, after


def gap():
    """Return a gap result as the first look makes it."""
    stamp = np.arange(1000) * 5_000_000
    value = np.sin(stamp * 1e-9)
    return GapResult(
        'unknown', 'The model misses something.',
        {'contraction': SignalGap('m', 1e-5, 1e-3, 5e-4, 5e-4)},
        [Share('muscle', 'contraction', 'all', 1.0),
         Share('muscle', 'contraction', 'contracting', 0.7),
         Share('muscle', 'contraction', 'extending', 0.3)],
        calibration=[Calibrated('K_m', 'Pa/V', 1e5, 1.01e5, (1e5, 1.02e5), 0.5)],
        traces={'contraction': Trace(stamp, value, value, value, value)})


def overlay(run):
    """Return an overlay of the run's contraction."""
    series = run.topics['contraction']
    value = series.values['contraction_m']
    return [Overlay('contraction', series.time_s(series.stamp_ns[0]), value, value + 1e-5)]


def test_a_report_is_complete_and_needs_no_network(tmp_path):
    run = tracking_run(AMPLITUDES, metadata=METADATA)
    found = pages.bag_report([run], tmp_path / 'out' / 'page.html', ['learning'])
    html, plots = markup(tmp_path / 'out' / 'page.html')
    for key in ('metrics', 'cycles', 'signals-0', 'timing', 'provenance'):
        assert f'id="{key}"' in html
    for title in ('contraction [mm]', 'pressure [kPa gauge]', 'force [N]', 'valve voltage [V]'):
        assert any(title == axis.get('title', {}).get('text')
                   for plot in plots for name, axis in plot['layout'].items()
                   if name.startswith('yaxis') and axis.get('title'))
    assert not re.search(r'(src|href)\s*=\s*["\']?(https?:)?//', html)
    assert 'url(' not in html and '@import' not in html
    assert (tmp_path / 'out' / 'page.html').read_text().count('plotly.js v') == 1
    assert found['learning']['cycle_rmse_m'][0] > found['learning']['cycle_rmse_m'][-1]
    assert [p.name for p in (tmp_path / 'out').iterdir()] == ['page.html']


def test_text_from_a_bag_cannot_become_markup(tmp_path):
    run = tracking_run(AMPLITUDES, metadata=METADATA)
    pages.bag_report([run], tmp_path / 'page.html', ['</script><b>'])
    content = (tmp_path / 'page.html').read_text()
    assert '<script>alert' not in content
    assert '</script><b>' not in content


def test_a_run_with_hardly_any_topics_still_has_a_page(tmp_path):
    run = step_run()
    del run.topics['reference']
    pages.bag_report([run], tmp_path / 'page.html')
    html, plots = markup(tmp_path / 'page.html')
    assert 'contraction [mm]' in str(plots)
    run.topics.clear()
    pages.bag_report([run], tmp_path / 'empty.html')
    assert 'holds no signal' in (tmp_path / 'empty.html').read_text()


@pytest.mark.parametrize('still', [('force',), ('pressure', 'contraction', 'reference')])
def test_stamps_that_never_change_have_no_rate(still, tmp_path):
    run = tracking_run(AMPLITUDES)
    for topic in still:
        series = run.topics[topic]
        still_ns = np.full_like(series.stamp_ns, series.stamp_ns[0])
        run.topics[topic] = replace(series, stamp_ns=still_ns)
    pages.bag_report([run], tmp_path / 'page.html')
    html, _ = markup(tmp_path / 'page.html')
    for topic in still:
        assert re.search(rf'<td>{topic}</td><td[^>]*>\d+</td><td[^>]*>–</td>', html)


def test_a_report_of_nothing_is_refused(tmp_path):
    with pytest.raises(InputError, match='at least one'):
        pages.bag_report([], tmp_path / 'page.html')
    assert not (tmp_path / 'page.html').exists()


@pytest.mark.parametrize('valve, names', [
    ('ppr', ['voltage', 'voltage, commanded']),
    ('hsv', ['fill', 'fill, commanded', 'vent', 'vent, commanded'])])
def test_commanded_valve_signals_are_drawn_beside_those_that_were_sent(valve, names, tmp_path):
    run = tracking_run(AMPLITUDES, valve=valve)
    sent = run.topics['valve_signal']
    run.topics['valve_command'] = Series(
        sent.stamp_ns[::2], {name: values[::2] + 0.25 for name, values in sent.values.items()})
    pages.bag_report([run], tmp_path / 'page.html')
    _, plots = markup(tmp_path / 'page.html')
    found = {trace['name']: trace for plot in plots for trace in plot['data']
             if trace.get('name') in names}
    assert list(found) == names
    for name in names[::2]:
        commanded, signal = found[f'{name}, commanded'], found[name]
        away = np.array(commanded['y'][:1]) - signal['y'][:1]
        assert away == pytest.approx(-0.25 if name == 'vent' else 0.25, abs=1e-3)
        assert commanded['line']['dash'] == 'dot' and commanded['line']['shape'] == 'hv'
    del run.topics['valve_signal']
    pages.bag_report([run], tmp_path / 'page.html')
    assert names[1] in str(markup(tmp_path / 'page.html')[1])


def test_runs_of_equal_name_stay_apart(tmp_path):
    found = pages.bag_report([step_run(), step_run()], tmp_path / 'page.html')
    assert len(found) == 2


@pytest.mark.parametrize('taken', ['report', 'remarks', 'implausible', 'over_seeds'])
def test_a_bag_with_the_name_of_another_key_is_numbered(taken, tmp_path):
    runs = [tracking_run(AMPLITUDES) for _ in range(2)]
    runs[0].path, runs[1].path = f'runs/{taken}', 'runs/second'
    assert set(pages.bag_report(runs, tmp_path / 'page.html')) == {f'{taken} (1)', 'second'}


def test_several_runs_are_laid_over_each_other(tmp_path):
    runs = [tracking_run(AMPLITUDES), tracking_run(AMPLITUDES[::-1]), step_run()]
    pages.bag_report(runs, tmp_path / 'page.html', ['one', 'two', 'three'])
    html, plots = markup(tmp_path / 'page.html')
    assert 'id="overlaid"' in html
    together = next(p for p in plots
                    if [t['name'] for t in p['data'][:4]] == ['one', 'two', 'three', 'reference'])
    assert len({t['line']['color'] for t in together['data'][:4]}) == 4
    assert len([t for t in together['data'] if t['yaxis'] == 'y3']) == 2   # pressure of two runs
    pages.bag_report(runs[:1], tmp_path / 'single.html')
    assert 'id="overlaid"' not in (tmp_path / 'single.html').read_text()


def seeded(amplitude_m, seed, controller='controller: pid\n'):
    """Return a run whose errors have an amplitude, recorded with a seed and a controller."""
    return tracking_run([amplitude_m] * 3, metadata={
        **METADATA, 'seed': str(seed), 'controller': controller})


def test_runs_of_several_seeds_have_mean_and_standard_deviation(tmp_path):
    runs = [seeded(1e-3, 1), seeded(2e-3, 2), seeded(3e-3, 3),
            seeded(1e-3, 1, 'controller: lqi\n'), seeded(5e-3, 2, 'controller: lqi\n'),
            seeded(9e-3, 1, 'controller: mpc\n')]
    titles = ['p1', 'p2', 'p3', 'l1', 'l2', 'm1']
    found = pages.bag_report(runs, tmp_path / 'page.html', titles)
    assert set(found) == {*titles, 'over_seeds'}
    pid, lqi = found['over_seeds']['pid: p1, p2, p3'], found['over_seeds']['lqi: l1, l2']
    assert len(found['over_seeds']) == 2
    assert pid['seeds'] == ['1', '2', '3'] and lqi['runs'] == ['l1', 'l2']
    assert pid['max_error_m']['mean'] == pytest.approx(2e-3, rel=1e-3)
    assert pid['max_error_m']['std'] == pytest.approx(1e-3, rel=1e-3)
    rmse_m = [found[title]['tracking_rmse_m'] for title in ('l1', 'l2')]
    assert lqi['tracking_rmse_m'] == {
        'mean': pytest.approx(np.mean(rmse_m)), 'std': pytest.approx(np.std(rmse_m, ddof=1))}
    assert lqi['cycle_rmse_m']['mean'] == pytest.approx([3e-3 / np.sqrt(2)] * 2, rel=2e-3)
    assert pid['mean_error_m']['mean'] == pytest.approx(np.mean(
        [found[title]['mean_error_m'] for title in titles[:3]]))
    body = markup(tmp_path / 'page.html')[0].partition('id="over-seeds"')[2]
    assert '2.000 ± 1.000 mm' in body.partition('</section>')[0]


def test_seeds_that_change_nothing_are_told(tmp_path):
    def told(*runs):
        found = pages.bag_report(runs, tmp_path / 'page.html', ['a', 'b'])['over_seeds']
        said = same_remarks(found)
        body = markup(tmp_path / 'page.html')[0].partition('id="over-seeds"')[2]
        assert ('same to the bit' in body.partition('</section>')[0]) == bool(said)
        return said
    other = seeded(1e-3, 2)
    said, = told(seeded(1e-3, 1), other)
    assert said.startswith('pid: a, b: the runs with seeds 1, 2 are the same to the bit')
    other['force'].values['force_n'][7] += 1e-9
    assert told(seeded(1e-3, 1), other) == []


def test_runs_whose_learning_is_frozen_are_counted_apart(tmp_path):
    runs = [seeded(1e-3 * k, k) for k in (1, 2, 3, 4)]
    for run, learning in zip(runs, (1.0, 1.0, 0.0, 0.0)):
        stamp_ns = run['pressure_command'].stamp_ns
        run.topics['controller_state'] = Series(
            stamp_ns, {'learning': np.where(np.arange(len(stamp_ns)) < 500, learning, 0.0)})
    found = pages.bag_report(runs, tmp_path / 'page.html', ['l1', 'l2', 'f3', 'f4'])
    assert set(found['over_seeds']) == {'pid: l1, l2', 'pid: f3, f4'}
    assert 'over_seeds' not in pages.bag_report(runs[1:3], tmp_path / 'two.html')


def test_overshoot_and_air_have_a_spread_over_seeds(tmp_path):
    rig = load_rig('dmsp_5_300_realistic').to_yaml()
    runs = [step_run(late_m=late_m) for late_m in (-1e-3, -2e-3)]
    for seed, run in enumerate(runs):
        stamp_ns = run['contraction'].stamp_ns
        run.topics['pressure'] = Series(
            stamp_ns, {'pressure_pa': 2e5 + (1.0 + seed) * np.linspace(0.0, 1e5, len(stamp_ns))})
        run.metadata.update(seed=str(seed), rig=rig, controller='controller: pid\n')
    spread, = pages.bag_report(runs, tmp_path / 'page.html')['over_seeds'].values()
    assert spread['overshoot_m']['mean'] == pytest.approx([1.5e-3], abs=1e-5)
    assert spread['air_use_kg']['std'] > 0.0
    assert ' mg<' in (tmp_path / 'page.html').read_text()


def test_repeated_runs_of_one_seed_and_other_references_are_no_seeds(tmp_path):
    other = seeded(2e-3, 2)
    other.metadata['preview_s'] = '0'
    found = pages.bag_report(
        [seeded(1e-3, 1), seeded(1e-3, 1), other, step_run()], tmp_path / 'page.html')
    assert 'over_seeds' not in found
    assert 'over-seeds' not in (tmp_path / 'page.html').read_text()


def test_the_table_of_figures_has_loops_saturation_and_air(tmp_path):
    rig = load_rig('dmsp_5_300_hanging_mass', valve='hsv').to_yaml()
    run = tracking_run(AMPLITUDES, valve='hsv', metadata={**METADATA, 'rig': rig})
    found = pages.bag_report([run], tmp_path / 'page.html', ['hsv'])['hsv']
    table = markup(tmp_path / 'page.html')[0].partition('id="metrics"')[2].partition('</table>')[0]
    for name in ('Tracking RMSE', 'Largest error', 'Valve at its upper limit',
                 'Air filled into the muscle', 'Air through the fill valve', 'Controller loop',
                 'Driver loop'):
        assert name in table
    assert found['air_fed_kg'] > 0.0 and found['air_use_kg'] > 0.0
    assert f'{1e3 * found["air_use_kg"]:.3g} g (' in table      # a small muscle: below 0.1 g
    pages.bag_report([step_run()], tmp_path / 'step.html')
    assert 'Settling into 5 % after a step' in (tmp_path / 'step.html').read_text()


def test_the_demo_page_is_small_and_has_the_key_numbers(tmp_path):
    learning = tracking_run(AMPLITUDES, noise_m=1e-5)
    frozen = tracking_run([2e-3] * 5, noise_m=1e-5)
    before, after = rules()
    replay = SimpleNamespace(identical=True, max_abs_difference_pa=0.0, recorded_pa=np.zeros(9))
    parts = [demo_page.DemoPart('PPR', 'One paragraph.',
                                [('PPR, learning', learning), ('PPR, frozen', frozen)],
                                before, after, overlay(learning),
                                [('PPR, learning', replay)]),
             demo_page.DemoPart('HSV', 'One paragraph.',
                                [('HSV, learning', tracking_run(AMPLITUDES, valve='hsv'))])]
    tuning = {'cost_before_mm': 1.0, 'changed': {'lead_s': {'before': 0.1, 'after': 0.12}},
              'history': [(10, 1.0), (20, 0.8)]}
    facts = demo_page.demo_report(tmp_path / 'demo.html', parts, tuning, gap(),
                                  [('ppr', 'rosbags', 'all read')], ['A note.'])
    html, plots = markup(tmp_path / 'demo.html')
    assert (tmp_path / 'demo.html').stat().st_size < 8e6
    assert {'PPR, learning', 'PPR, frozen', 'HSV, learning'} == set(facts)
    numbers = re.findall(r'<b>(.*?)</b>', html)
    assert any('→' in n for n in numbers) and '1.00 mm' in numbers
    bars = next(p for p in plots if p['data'][0]['type'] == 'bar')
    assert [trace['name'] for trace in bars['data']] == ['PPR, learning', 'PPR, frozen']
    assert 'A note.' in html and 'duty' in str(plots) and 'lead_s' in html
    for key in ('part1-rules', 'part1-overlays', 'part1-replay', 'tuning', 'gap', 'provenance'):
        assert f'id="{key}"' in html


def test_rule_maps_share_one_colour_scale(tmp_path):
    write_text(tmp_path / 'page.html', rules_section(*rules()).body)
    _, plots = markup(tmp_path / 'page.html')
    maps = [t for p in plots for t in p['data'] if t['type'] == 'heatmap']
    assert len(maps) == 4
    assert len({(m['zmin'], m['zmax']) for m in maps}) == 1
    assert maps[0]['zmax'] == pytest.approx(6.0)


def test_every_axis_of_a_stack_zooms_with_the_first():
    line = figures.line([0, 1], [0, 1], 'a', 'measured')
    layout = figures.stack([('a [m]', [line])] * 3, 'time [s]')['layout']
    assert layout['xaxis2']['matches'] == layout['xaxis3']['matches'] == 'x'
    domains = [layout[f'yaxis{k}']['domain'] for k in ('', '2', '3')]
    assert domains[0][0] > domains[1][1] and domains[1][0] > domains[2][1]


def test_signs_of_what_rounds_to_zero():
    assert page.signed(-0.3) == '0' and page.signed(4.6) == '+5' and page.signed(-4.6) == '-5'


def test_the_camera_of_a_plot_saves_a_vector_graphic(tmp_path):
    pages.bag_report([step_run()], tmp_path / 'page.html')
    script = (tmp_path / 'page.html').read_text(encoding='utf-8').rpartition('<script>')[2]
    options = re.search(r'Plotly\.react\(node.*?\}\);', script, re.S).group()
    assert "'toImage'" in options and "toImageButtonOptions: { format: 'svg' }" in options


def test_a_failed_write_leaves_the_old_page(tmp_path):
    path = tmp_path / 'page.html'
    path.write_text('old')
    with pytest.raises(UnicodeEncodeError):
        write_text(path, 'new \ud800')
    assert path.read_text() == 'old'
    assert [p.name for p in tmp_path.iterdir()] == ['page.html']
