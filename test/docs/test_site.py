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

from html import unescape
import itertools
import os
from pathlib import Path
import re
import subprocess
import sys
from urllib.parse import unquote, urlsplit

import pytest

ROOT = Path(__file__).resolve().parents[2]

pytestmark = pytest.mark.slow


# A tag with its attributes; the parser of HTML of Python takes six times as long.
TAG = re.compile(
    r"""<(?:!--.*?--|([a-z][a-z0-9]*)((?:[^<>"']|"[^"]*"|'[^']*')*))>""", re.S | re.I)
GIVEN = re.compile(
    r"""\s(id|name|href|src|rel)\s*=\s*("[^"]*"|'[^']*'|[^\s"'>]+)""", re.I)


class Page:
    """What a page links to, what it loads and the places that can be linked to."""

    def __init__(self, path):
        self.links, self.loads, self.ids = [], [], set()
        self.text = path.read_text(encoding='utf-8')
        for tag, attributes in TAG.findall(self.text):
            if '=' in attributes:
                self._read(tag.lower(), {
                    key.lower(): unescape(value.strip('"\''))
                    for key, value in GIVEN.findall(attributes)})

    def _read(self, tag, given):
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


def links_to_nothing(site, pages):
    """Return `page: link` of all links within the site that lead nowhere."""
    wrong = set()
    for path, page in pages.items():
        for link in set(page.links):
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = path
            if parts.path:
                target = Path(os.path.normpath(path.parent / unquote(parts.path)))
            if target not in pages and not target.is_file():
                wrong.add(f'{path.relative_to(site)}: {link}')
            elif parts.fragment and target.suffix == '.html' and (
                    unquote(parts.fragment) not in pages[target].ids):
                wrong.add(f'{path.relative_to(site)}: no place {link}')
    return sorted(wrong)


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
    left = {f'{path.name}: {found[0]}' for path, page in pages.items()
            if (found := re.search(r':(?:mod|class|func|meth|data|attr|exc|obj|ref|doc):`[^<]*',
                                   page.text))}
    assert not left


def test_links_lead_to_pages_and_places_that_exist(site, pages):
    assert not links_to_nothing(site, pages)


def test_what_counts_as_a_link_to_nothing(tmp_path):
    (tmp_path / 'below').mkdir()
    (tmp_path / 'one.html').write_text(
        '<!-- <a href="no"> --><p id=a>1 < 2</p><a name="b"></a><A HREF=\'below/two.html#c\'>'
        '<a href="#a"><a href="#b"><a href="https://x/y.html#z"><a href="below/two.html#d&amp;">'
        '<a\nclass="p>q" href="no.html"><a href="below"><a href=#e><a href="file%20a.txt#x">')
    (tmp_path / 'below' / 'two.html').write_text(
        '<a href="../one.html"><a href="../one.html#c"><h1 id="c"><h2 id="d&amp;"><a href="two">')
    (tmp_path / 'file a.txt').write_text('')
    pages = {path: Page(path) for path in tmp_path.rglob('*.html')}
    assert links_to_nothing(tmp_path, pages) == [
        'below/two.html: no place ../one.html#c', 'below/two.html: two', 'one.html: below',
        'one.html: no place #e', 'one.html: no.html']


def test_the_tree_beside_a_page_marks_that_page_only(site, pages):
    """The mark is moved from page to page: no tree is made by the theme twice."""
    for path, page in pages.items():
        if path.relative_to(site).as_posix() not in (
                'index.html', 'search.html', 'genindex.html', 'py-modindex.html'):
            title, = re.findall('<title>(.*) - pam_actuation', page.text)
            marked, = re.findall(r' current-page">(.*?)</a>', page.text)
            shown = re.search('<a class="current reference internal" href="#">(.*)', marked)[1]
            assert re.sub('<.*?>', '', shown) == title, path


def test_a_search_in_a_page_finds_what_docutils_finds(monkeypatch):
    docutils = pytest.importorskip('docutils.core', reason='the docs extra has it')
    from docutils import nodes
    monkeypatch.syspath_prepend(str(ROOT / 'docs'))
    from generate import tree_search
    tree = docutils.publish_doctree('A *b*\n\n* c\n\n  * d **e** f\n\n  * ``g``\n\n* h\n\ni')
    below = tree.next_node(nodes.bullet_list)
    for node, condition, options in itertools.product(
            (tree, below, below.next_node(nodes.Text)),
            (None, nodes.Text, nodes.list_item, nodes.table, lambda one: len(one.children) == 1),
            ({}, {'include_self': False}, {'descend': False}, {'siblings': True},
             {'ascend': True})):
        found = list(tree_search._findall(node, condition, **options))
        wanted = list(tree_search._of_docutils(node, condition, **options))
        assert list(map(id, found)) == list(map(id, wanted)), (node, condition, options)


def test_nothing_is_fetched_from_a_network(site, pages):
    remote = {load for page in pages.values() for load in page.loads
              if urlsplit(load).scheme not in ('', 'data') or urlsplit(load).netloc}
    assert not remote
    for sheet in site.rglob('*.css'):
        text = sheet.read_text(encoding='utf-8')
        assert 'url(http' not in text and '@import' not in text, sheet


def test_every_option_of_every_verb_has_its_row(site, pages):
    from pam_actuation.cli.main import build_parser
    verbs, = (action.choices for action in build_parser()._actions
              if isinstance(action.choices, dict))
    for name, parser in verbs.items():
        text = pages[site / 'reference' / 'cli' / f'{name}.html'].text
        for action in parser._actions:
            for option in action.option_strings:
                assert f'<span class="pre">{option}</span>' in text, (name, option)


def test_options_in_the_text_keep_their_hyphens(site, pages):
    text = pages[site / 'reference/cli/rig.html'].text
    assert re.search(r'or with <code[^>]*><span class="pre">--bore-mm</span></code> the', text)
    for path, page in pages.items():
        found = re.search(r'[ (>]–[a-z][^<]{0,20}', page.text)
        assert not found, (path.name, found)
