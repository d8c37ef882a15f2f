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

"""Recordings as people have them, of the independent simulator: what their keys say."""

import numpy as np
import truth_everyday as everyday


def test_the_refit_of_a_closed_loop_starts_before_the_first_message_of_the_controller(tmp_path):
    def controlled(case, numbers, chain, part):
        """Return the messages of a controller that wants a high pressure at once."""
        sent_s = 0.005 * np.arange(600) + 0.003
        volts = 3.0 + np.sin(2.0 * np.pi * sent_s)
        return sent_s, volts[:, np.newaxis], 1e5 * volts

    # A load cell that is off says nothing about the pressure.
    case = everyday.Case('one', 'closed_loop', 'ppr', (1, 2), 'force_bias', 'pid')
    key = everyday.build(case, tmp_path / 'one', controlled)
    assert key['gap_sigma']['pressure'] < 0.1
