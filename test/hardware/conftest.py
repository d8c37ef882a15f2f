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

"""Lets the tests with live nodes use the helpers of the tests of the nodes."""

from pathlib import Path
import sys

from own_dac import write_metadata
import pytest

sys.path.append(str(Path(__file__).parent.parent / 'nodes'))


@pytest.fixture(scope='session')
def metadata_of_own_dac(tmp_path_factory):
    """Return a folder that is the same for all tests, so that they share a template of nodes."""
    folder = tmp_path_factory.mktemp('own_dac')
    write_metadata(folder)
    return folder


@pytest.fixture
def own_dac_installed(metadata_of_own_dac, monkeypatch):
    """Let Python find ``own_dac`` as if it were installed, in this process and its children."""
    monkeypatch.setenv('PYTHONPATH', f'{metadata_of_own_dac}:{Path(__file__).parent}')
