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
What `pam gap` alone makes of the steps, beside black boxes fitted to the same samples.

Used by ``real_records.py``. The recording has few moves, so `pam gap` deals stretches of its edges
out in turn. Black boxes are fitted to the samples that it fits and chooses by. All are judged on
the stretches that it keeps for the proof, in free run from the command alone.
"""

import black_boxes
import numpy as np
from pam_sim.gap import find_gap
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.split import CERTIFY, split_of, UNUSED

DELAYS = range(4, 15)        # samples, of the black boxes
TABLED = {'pressure': (1e-3, 'kPa'), 'contraction': (1e3, 'mm')}
BAR = 1.2                    # times the best black box


def print_table(run, rig, seconds, names=None):
    """
    Print the rms errors of the model, before and after, and of black boxes.

    Parameters
    ----------
    run : pam_sim.run.Run
        The steps.
    rig : pam_sim.Rig
        The model before.
    seconds : float
        Time budget of the search.
    names : sequence of str, optional
        Names to try; all by default.

    """
    result = find_gap(run, rig, None, names, seconds)
    recording = Recording(run, 'ppr')
    split = split_of(recording)
    volts = np.interp(recording.time_s['pressure'], recording.valve_stamps_s,
                      run.topics['valve_signal'].values['ppr_voltage'])
    print(f'Blocks of {split.block_s:.3f} s; {result.simulations} simulations. Verdict '
          f'{result.verdict}: ' + ', '.join(f'`{e["name"]}`' for e in result.effects)
          + '; not told apart: ' + (', '.join(f'`{n}`' for n in result.ambiguity_set if n not in [
              e['name'] for e in result.effects]) or '–') + '.\n')
    print('| in free run from the command, rms | pressure: fitted [kPa] | judged [kPa] | '
          'contraction: fitted [mm] | judged [mm] |\n|---|---|---|---|---|')
    rows, labels = {}, []
    for signal, (factor, _) in TABLED.items():
        trace = result.traces[signal]
        part = split.part_of(recording.time_s[signal], signal)
        judged, fitted = part == CERTIFY, ~np.isin(part, (CERTIFY, UNUSED))
        runs = {'before': trace.before, 'calibrated': trace.refit, '`pam gap`': trace.after}
        for kind in (black_boxes.arx, black_boxes.narx):
            name = kind.__name__.upper()
            runs[name], _, label = kind(volts, trace.measured, fitted, DELAYS)
            labels.append(f'- {name}, {signal}: {label}')
        for name, one in runs.items():
            rows.setdefault(name, []).extend(
                factor * black_boxes.rms((one - trace.measured)[chosen])
                for chosen in (fitted, judged))
    for name, cells in rows.items():
        print(f'| {name} | ' + ' | '.join(f'{cell:.3f}' for cell in cells) + ' |')
    ratios = [rows['`pam gap`'][k] / min(rows[name][k] for name in ('ARX', 'NARX'))
              for k in (1, 3)]
    print(f'\nRatio to the best black box on the judged part: pressure {ratios[0]:.2f}, '
          f'contraction {ratios[1]:.2f}; bar {BAR}.\n\n' + '\n'.join(labels))
