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

"""The form of investigation.json as JSON Schema."""

from importlib.resources import files
import json
from typing import Any

from pam_sim.gap.report.schema import report_schema


def investigation_schema() -> dict[str, Any]:
    """
    Return the JSON Schema (draft 2020-12) of investigation.json, as a new mapping.

    What it has in common with gap.json is defined there, and entered under ``$defs``.
    """
    text = files('pam_actuation.investigate').joinpath(
        'investigation.schema.json').read_text(encoding='utf-8')
    schema: dict[str, Any] = json.loads(text)
    shared = report_schema()['$defs']
    schema['$defs'] = {**schema['$defs'], **{
        name: shared[name] for name in (
            'interval', 'quantity', 'effect', 'parameter', 'subsystem', 'signal', 'proposal',
            'surrogate', 'next_experiment')}}
    return schema
