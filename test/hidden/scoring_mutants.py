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

"""Answerers that examine the scorer: one knows the key, the others always say the same."""


def oracle(key, after=False):
    """Return the best possible result for a case; ``after`` the suggested experiment."""
    floor, gap = 1.0, 10.0
    effects = [{
        'name': name, 'family': key['family'][name], 'subsystem': key['subsystem'][name],
        'confidence': 0.99, 'parameters': {}, 'equivalent': {
            quantity: {'value': true, 'unit': '', 'ci95': [true - abs(true), true + abs(true)]}
            for quantity, true in key['equivalent'].get(name, {}).items()}}
        for name in key['effects']]
    parameters = [{'name': name, 'nominal': 0.0, 'value': value, 'unit': '',
                   'ci95': [0.9 * value, 1.1 * value]} for name, value in key['wrong'].items()]
    ambiguous = bool(key['rivals']) and not after
    verdict = ('ambiguous' if ambiguous else 'effects' if effects else
               'parameter' if parameters else 'unknown' if key['outside'] else 'no_gap')
    suggestion = None
    if ambiguous:
        suggestion = {'name': 'tell apart', 'why': '', 'experiment': {
            'domain': 'pressure', 'needs': ['force'], 'segments': [
                {'random_steps': {'low_pa': 3e5, 'high_pa': 6e5}}]}}
    return {
        'verdict': verdict, 'effects': effects, 'parameters': parameters,
        'ambiguity_set': key['rivals'] if ambiguous else key['effects'],
        'next_experiment': suggestion, 'unexplained_fraction': 0.0, 'runtime_s': 1.0,
        'where': [{'subsystem': e['subsystem'], 'share_of_gap': 1.0} for e in effects],
        'signals': {'contraction': {'noise_floor': floor, 'rmse_refit': gap,
                                    'rmse_after': floor if effects else gap}}}


def constant(verdict, name=''):
    """Return a result that is always the same."""
    effects = [{'name': name, 'subsystem': 'muscle', 'confidence': 0.99}] if name else []
    return {'verdict': verdict, 'effects': effects, 'ambiguity_set': [name] if name else [],
            'where': [], 'signals': {}, 'unexplained_fraction': 0.0, 'runtime_s': 1.0}
