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
Find the gap between recordings and a model, name what is missing, add it and prove it.

The files in reading order: ``health`` (can these data be used), ``noise`` (what
sensors and stamps explain), ``parts`` (what is fitted, what judges, what proves),
``free_run`` (the model on the recorded valve signal), ``cuts`` (each subsystem on its
measured input), ``candidates`` (what may be missing), ``hypothesis`` (what a model may have
beyond the given one), ``solver`` (one least-squares problem), ``fit`` (hypotheses fitted),
``side_by_side`` (several at once), ``screen`` (which are worth a fit), ``compare`` (which one
the data prefer), ``choice`` (which rival wins), ``search`` (one effect after another),
``pairs`` (two at once, where that fails), ``finish`` (what of them stays), ``uncertainty`` (how
well its numbers are known), ``prove`` (free runs on data kept aside), ``doubt`` (how much these
can tell), ``refute`` (which names they contradict), ``locate`` (where the gap sits),
``workflow`` (all of it in order, and the verdict), ``words`` (the verdict in sentences),
``result`` (what gap.json holds).
A witness without a model of what is missing: ``fingerprint``. Before anything is measured:
``plan`` (what a protocol could show) and ``look_alikes``.
"""

from pam_sim.gap.result import GapResult
from pam_sim.gap.workflow import find_gap

__all__ = ['find_gap', 'GapResult']
