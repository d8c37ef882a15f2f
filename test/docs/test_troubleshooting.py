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

"""The page of troubleshooting quotes what the program says."""

from pathlib import Path
import re

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / 'docs' / 'guides' / 'troubleshooting.md'
SOURCES = ''.join(path.read_text(encoding='utf-8') for package in ('pam_actuation', 'pam_sim')
                  for path in sorted((ROOT / package).rglob('*.py')))
# Of the shell, of make and pip, and names of options, files and topics.
OTHERS = re.compile(r'pam[ :]|--|make|import |metadata|/|pip')


def quoted():
    """Return what the first column quotes; an ellipsis stands for what differs."""
    cells = re.findall(r'^\| (?!what you see|---)(.*?) \|', PAGE.read_text(encoding='utf-8'), re.M)
    spans = [span for cell in cells for span in re.findall(r'`([^`]+)`', cell)]
    return [span.strip(' …') for span in spans if not OTHERS.match(span)]


def test_what_the_page_quotes_is_what_the_program_says():
    texts = quoted()
    assert len(texts) > 10
    assert [text for text in texts if text not in SOURCES] == []
