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

"""A parameter that no file could use is refused where it is declared."""

from pam_actuation.control.settings import setting
from pam_sim.errors import InputError
from pam_sim.parameters import Parameter
import pytest


@pytest.mark.parametrize('given, sentence', [
    (('area_m2', 'm^2', 2.3e-4, 1e-3, 0.1),
     '`area_m2` is 0.00023 by default; allowed 0.001 to 0.1 m^2'),
    (('loss_n', 'N', float('nan'), 0.0, 1.0), '`loss_n` is nan by default; allowed 0 to 1 N'),
    (('loss_n', 'N', 2e4, 0.0, 1e6, 0.0, 0.1, 'Loss.', 'design'),
     "parameter `loss_n` has description = 0.1; write a text, '...'"),
    (('loss_n', 2e4, 'N', 0.0, 1e6), "parameter `loss_n` has unit = 20000.0; write a text, '...'"),
    (('loss_n', 'N', 1.0, '0', 1e6), "parameter `loss_n` has lower = '0'; write a number"),
    (('mode', '-', 'slow', 0.0, 1.0, 0.0, '', '', 'slow'),
     "parameter `mode` has choices = 'slow'; write a tuple, choices=('x',) or choices=()")])
def test_a_wrong_declaration_is_told_in_one_sentence(given, sentence):
    with pytest.raises(InputError) as caught:
        Parameter(*given)
    assert caught.value.problem == sentence


def test_a_setting_of_a_controller_outside_its_own_range_is_refused():
    with pytest.raises(InputError, match='`toll_pa` is 5 by default; allowed 10 to 100000 Pa'):
        setting('toll_pa', 'Pa', 5.0, 10.0, 1e5, 'A made up one.')
