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

"""The documentation as a site: it builds without a warning, and every link leads somewhere."""

from html.parser import HTMLParser
import os
from pathlib import Path
import re
import subprocess
import sys
from urllib.parse import unquote, urlsplit

import pytest

ROOT = Path(__file__).resolve().parents[2]

pytestmark = pytest.mark.slow


class Page(HTMLParser):
    """Collects what a page links to, what it loads and the places that can be linked to."""

    def __init__(self, path):
        super().__init__()
        self.links, self.loads, self.ids = [], [], set()
        self.feed(path.read_text(encoding='utf-8'))

    def handle_starttag(self, tag, attrs):
        """Read one tag."""
        given = dict(attrs)
        self.ids.add(given.get('id'))
        self.ids.add(given.get('name') if tag == 'a' else None)
        if tag == 'a' and given.get('href'):
            self.links.append(given['href'])
        elif tag in ('script', 'img', 'iframe') and given.get('src'):
            self.loads.append(given['src'])
        elif tag == 'link' and given.get('rel') != 'canonical':
            self.loads.append(given['href'])


@pytest.fixture(scope='module')
def site(tmp_path_factory):
    """Return the folder of the built site; a warning fails."""
    pytest.importorskip('sphinx', reason='Sphinx is not installed (the docs extra has it)')
    folder = tmp_path_factory.mktemp('site')
    done = subprocess.run(
        [sys.executable, '-m', 'sphinx', '-W', '--keep-going', '-q', '-b', 'html', 'docs',
         str(folder)], cwd=ROOT, capture_output=True, text=True,
        env={**os.environ, 'PYTHONHASHSEED': '0'})
    assert done.returncode == 0, done.stderr[-5000:]
    return folder


@pytest.fixture(scope='module')
def pages(site):
    """Return the read pages by path."""
    return {path: Page(path) for path in site.rglob('*.html')}


@pytest.mark.timeout(1200)
def test_the_site_has_its_parts(site, pages):
    for name in ('index.html', 'search.html', 'searchindex.js', 'reference/cli/gap.html',
                 'reference/api/pam_sim.html', 'reference/topics/force.html'):
        assert (site / name).is_file()
    assert len(pages) > 100


def test_no_markup_is_left_in_the_text(pages):
    left = {f'{path.name}: {found[0]}' for path in pages
            if (found := re.search(r':(?:mod|class|func|meth|data|attr|exc|obj|ref|doc):`[^<]*',
                                   path.read_text(encoding='utf-8')))}
    assert not left


def test_links_lead_to_pages_and_places_that_exist(site, pages):
    wrong = []
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.is_file():
                wrong.append(f'{path.relative_to(site)}: {link}')
            elif parts.fragment and target.suffix == '.html' and (
                    unquote(parts.fragment) not in pages[target].ids):
                wrong.append(f'{path.relative_to(site)}: no place {link}')
    assert not wrong, '\n'.join(sorted(set(wrong))[:50])


def test_nothing_is_fetched_from_a_network(site, pages):
    remote = {load for page in pages.values() for load in page.loads
              if urlsplit(load).scheme not in ('', 'data') or urlsplit(load).netloc}
    assert not remote
    for sheet in site.rglob('*.css'):
        text = sheet.read_text(encoding='utf-8')
        assert 'url(http' not in text and '@import' not in text, sheet


def test_every_option_of_every_verb_has_its_row(site):
    from pam_actuation.cli.main import build_parser
    verbs, = (action.choices for action in build_parser()._actions
              if isinstance(action.choices, dict))
    for name, parser in verbs.items():
        text = (site / 'reference' / 'cli' / f'{name}.html').read_text(encoding='utf-8')
        for action in parser._actions:
            for option in action.option_strings:
                assert f'<span class="pre">{option}</span>' in text, (name, option)


def test_options_in_the_text_keep_their_hyphens(site):
    text = (site / 'reference/cli/rig.html').read_text(encoding='utf-8')
    assert re.search(r'or with <code[^>]*><span class="pre">--bore-mm</span></code> the', text)
    for path in site.rglob('*.html'):
        found = re.search(r'[ (>]–[a-z][^<]{0,20}', path.read_text(encoding='utf-8'))
        assert not found, (path.name, found)
