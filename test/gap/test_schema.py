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

"""The JSON Schema of gap.json: it is one, and it is strict."""

from gap_runs import assert_form
from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError
from pam_sim.gap.report.schema import report_schema
from pam_sim.gap.result import GapResult
import pytest


def objects(schema):
    """Return every object of the schema with properties of its own."""
    return [one for one in (schema, *schema['$defs'].values()) if 'properties' in one]


def test_it_is_a_schema_in_which_every_key_is_explained():
    schema = report_schema()
    Draft202012Validator.check_schema(schema)
    for one in objects(schema):
        assert one['additionalProperties'] is False
        assert set(one['required']) == set(one['properties'])
        for name, held in one['properties'].items():
            assert held.get('description') or '$ref' in held or 'oneOf' in held, name


def test_it_names_the_keys_of_an_empty_report_and_refuses_others():
    result = GapResult('no_gap', 'Nothing is missing.')
    assert_form(result)
    assert set(result.to_dict()) == set(report_schema()['properties'])
    assert result.to_dict()['proposal'] is None
    result.verdict = 'perhaps'
    with pytest.raises(ValidationError, match='perhaps'):
        assert_form(result)
