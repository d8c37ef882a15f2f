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
"""The hooks of a proposed effect: what each reads and returns, and the text of one."""

import re

# Where each stand-in reads its inputs, in the order of its inputs; F of the muscle is force_n.
READS = {
    'muscle_term': ('pressure_pa - P_ATM_PA', 'contraction_m', 'velocity_m_per_s',
                    'plant.time_s', 'force_n'),
    'load_term': ('contraction_m', 'velocity_m_per_s', 'plant.time_s'),
    'set_point_term': ('set_point_pa - P_ATM_PA', 'set_point_pa - pressure_pa',
                       'pressure_pa - P_ATM_PA', 'contraction_m', 'plant.time_s'),
    'flow_term': ('pressure_pa - P_ATM_PA', 'plant.contraction_m', 'state.filling',
                  'state.venting', 'plant.time_s'),
    'contraction_reading_term': ('pressure_pa - P_ATM_PA', 'contraction_m', 'force_n',
                                 'plant.time_s'),
    'force_reading_term': ('pressure_pa - P_ATM_PA', 'contraction_m', 'force_n', 'plant.time_s'),
}
# Of every channel: hook, what it returns, and the returned expressions with {sum}.
HOOKS = {
    ('muscle_term', 0): ('muscle_force', 'force_n + {0}'),
    ('muscle_term', 1): ('muscle_friction', 'max(level_n + {0}, 0.0)'),
    ('load_term', 0): ('load_force', 'force_n + {0}'),
    ('load_term', 1): ('load_friction', 'max(level_n + {0}, 0.0)'),
    ('set_point_term', 0): ('set_point', 'set_point_pa + {0}, time_constant_s'),
    ('set_point_term', 1): (
        'set_point', 'set_point_pa, time_constant_s / max(1.0 + {0}, 0.1)'),
    ('flow_term', 0): ('mass_flow', 'flow_kg_per_s + {0}'),
    ('flow_term', 1): ('valve_flow', 'fill_kg_per_s * max(1.0 + {0}, 0.0), vent_kg_per_s'),
    ('flow_term', 2): ('valve_flow', 'fill_kg_per_s, vent_kg_per_s * max(1.0 + {0}, 0.0)'),
    ('contraction_reading_term', 0): ('sensor', 'pressure_pa, contraction_m + {0}, force_n'),
    ('force_reading_term', 0): ('sensor', 'pressure_pa, contraction_m, force_n + {0}'),
}
BOTH = {
    'set_point': 'set_point_pa + {0}, time_constant_s / max(1.0 + {1}, 0.1)',
    'valve_flow': ('fill_kg_per_s * max(1.0 + {0}, 0.0), '
                   'vent_kg_per_s * max(1.0 + {1}, 0.0)')}
RETURNS = {'set_point': 'tuple[float, float]', 'valve_flow': 'tuple[float, float]',
           'sensor': 'tuple[float, float, float]'}
COMMIT = {'contraction_reading_term': 'sensor_commit', 'force_reading_term': 'sensor_commit',
          'set_point_term': 'set_point'}
ARGUMENTS = (
    'set_point_pa', 'time_constant_s', 'fill_kg_per_s', 'vent_kg_per_s', 'flow_kg_per_s',
    'force_n', 'level_n', 'pressure_pa', 'contraction_m', 'velocity_m_per_s', 'elapsed_s',
    'dt_s', 'state', 'par', 'plant')


def hook_text(hook: str, rows: list[str], returns: str, sentence: str) -> str:
    """Return a hook with the arguments that its lines name."""
    body = ' '.join(rows)
    arguments = [a for a in ARGUMENTS if re.search(rf'\b{a}\b', body)]
    return function_text(hook, rows, arguments, returns, sentence)


def function_text(hook: str, rows: list[str], arguments: list[str], returns: str,
                  sentence: str) -> str:
    """Return a compiled function with these arguments and lines."""
    typed = [f'{a}: np.record' if a in ('state', 'par', 'plant') else f'{a}: float'
             for a in arguments]
    given = (',\n' + ' ' * (len(hook) + 5)).join(typed)
    return '\n'.join(['@compiled', f'def {hook}({given}) -> {returns}:', f'    """{sentence}"""',
                      *(f'    {row}' for row in rows), ''])
