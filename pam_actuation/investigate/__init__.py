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
From a question to an answer: record, find the gap, record what would tell rivals apart, again.

``question`` is what is asked. ``recorder`` is the interface of what records; ``simulated`` and
``live`` are its two forms. ``motion`` is what a person is told before a muscle moves.
``store`` keeps the folder, ``rounds`` reads a round from it, ``decide`` says what follows it.
``loop`` is the investigation itself. ``outcome`` and ``page`` tell the result. No module here
imports ROS.
"""

from pam_actuation.investigate.loop import Budget, Investigation
from pam_actuation.investigate.outcome import Outcome
from pam_actuation.investigate.question import Question

__all__ = ['Budget', 'Investigation', 'Outcome', 'Question']
