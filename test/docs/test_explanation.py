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

"""The explanation: what its pages state is what their figures' runs give."""

import json
from pathlib import Path
import re
import sys

import pytest

ROOT = Path(__file__).resolve().parents[2]
FIGURES = ROOT / 'docs' / 'figures' / 'explanation'
DRAWN = ('muscle', 'control', 'gap')
PAGES = (*DRAWN, 'valves')          # a test of the valves has the numbers of that anew


def plain(text):
    return ' '.join(text.split())


@pytest.mark.parametrize('page', PAGES)
def test_a_page_states_the_numbers_of_its_figures(page):
    text = plain((ROOT / f'docs/explanation/{page}.md').read_text(encoding='utf-8'))
    numbers = json.loads((FIGURES / f'{page}.json').read_text(encoding='utf-8'))
    missing = {what: number for what, number in numbers.items() if plain(number) not in text}
    assert not missing and len(numbers) > 4


def test_every_figure_is_on_its_page():
    for page in PAGES:
        text = (ROOT / f'docs/explanation/{page}.md').read_text(encoding='utf-8')
        shown = set(re.findall(r'figures/explanation/(\w+\.svg)', text))
        assert shown == {path.name for path in FIGURES.glob(f'{page}_*.svg')}, page


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize('page', DRAWN)
def test_the_runs_give_the_same_numbers_again(page, tmp_path, monkeypatch):
    pytest.importorskip('matplotlib', reason='matplotlib is not installed')
    monkeypatch.setattr(sys, 'path', [*sys.path, str(ROOT / 'docs')])
    from generate.figures import remake
    numbers = remake(page, tmp_path)
    assert numbers == json.loads((FIGURES / f'{page}.json').read_text(encoding='utf-8'))
    made = {path.name for path in tmp_path.glob('*.svg')}
    assert made == {path.name for path in FIGURES.glob(f'{page}_*.svg')}


def test_the_introduction_to_the_gap_method_is_short():
    text = (ROOT / 'docs/explanation/gap.md').read_text(encoding='utf-8')
    assert len(text.split()) <= 1500
