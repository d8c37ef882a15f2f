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

"""What several tests of the gap look ask for."""

import pytest


@pytest.fixture
def no_proposal(monkeypatch):
    """Look for no form of what is left without a name: such looks have tests of their own."""
    monkeypatch.setattr('pam_sim.gap.workflow.propose', lambda *given: None)
