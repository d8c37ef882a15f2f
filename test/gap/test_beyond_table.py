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

"""Recordings that leave the table of a measured force law are told, with its range."""

from types import SimpleNamespace
import warnings

import numpy as np
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.gap import find_gap, workflow
from pam_sim.gap.data.beyond_table import beyond_table
from pam_sim.muscle.law import ExtrapolationWarning
from pam_sim.units import P_ATM_PA
import pytest

NOMINAL = 'dmsp_5_300_hanging_mass'


def recording(gauge_pa, contraction_m):
    time_s = np.arange(len(gauge_pa)) * 0.01
    return SimpleNamespace(
        time_s=dict.fromkeys(('pressure', 'contraction'), time_s),
        measured={'pressure': P_ATM_PA + np.array(gauge_pa), 'contraction': contraction_m})


def test_the_share_and_the_range_of_the_table_are_told():
    rig = load_rig('name: table\nmuscle: {like: dmsp_5_300, law: lookup}\nload: hanging_mass\n')
    inside = recording([-200.0, 0.0, 3e5, 6e5], [-1e-5, 0.0, 0.02, 0.04])
    assert beyond_table([inside], rig) == []        # noise about 0 is not outside
    told, = beyond_table([inside, recording([7e5, 1e5, 1e5, 1e5], [0.0, 0.09, 0.0, 0.0])], rig)
    assert told.startswith('In 25 % of the recorded time pressure or contraction is outside the '
                           'table of law `lookup`, 0 to 600 kPa and up to ')
    assert beyond_table([recording([9e5], [0.0])], load_rig(NOMINAL)) == []


def test_a_trial_beyond_the_table_is_not_told(monkeypatch):
    def trial(*_):
        warnings.warn('100 % of the simulation lies outside', ExtrapolationWarning, stacklevel=2)
        raise InputError('enough', 'trial')
    monkeypatch.setattr(workflow, '_answered', trial)
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        with pytest.raises(InputError, match='enough'):
            find_gap([], load_rig(NOMINAL))
