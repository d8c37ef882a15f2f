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

"""Quicker navigation: a page shows the titles beside it and of the folders above it only."""

import re

from sphinx import addnodes

# The entry of a page in the tree of its own page, and in that of a page of the same folder.
_OWN = r'(<li class="toctree-l\d+) current current-page("><a class=")current ([^>]*href=")#(">)'
_OTHER = r'(<li class="toctree-l\d+)("><a class=")([^>]*href="){}(">)'
_TO_OWN, _TO_OTHER = r'\1 current current-page\2current \3#\4', r'\1\2\3{}\4'


def _with_titles(toc):
    """Return a copy of the contents of a page: its title and the pages below it."""
    toc = toc.deepcopy()
    for entry in toc.children:
        if len(entry) > 1:
            below = list(entry.findall(addnodes.toctree))
            if below:
                entry[1][:] = below
            else:
                entry.pop(1)
    return toc


class _Neighbours:
    """
    The trees of pages that differ only in which entry is that of the page itself.

    These are the pages of one folder below the same page, with no pages below themselves. The
    theme makes the tree of the first of them; for the others the mark moves to their entry.
    """

    def __init__(self, app):
        self._includes, self._address = app.env.toctree_includes, app.builder.get_target_uri
        self._parents = {child: parent for parent, children in self._includes.items()
                         for child in children}
        self._unmarked = {}

    def _group(self, page):
        return page.rpartition('/')[0], self._parents[page]

    def _entry(self, page):
        return self._address(page).rpartition('/')[2]

    def keep(self, page, tree):
        """Keep the tree that the theme made of a page."""
        if page in self._parents and page not in self._includes:
            unmarked, count = re.subn(_OWN, _TO_OTHER.format(self._entry(page)), tree)
            if count == 1:
                self._unmarked[self._group(page)] = unmarked

    def tree(self, page):
        """Return the tree of a page, or None where no neighbour has had its own made."""
        if page not in self._parents or page in self._includes or (
                self._group(page) not in self._unmarked):
            return None
        tree, count = re.subn(_OTHER.format(re.escape(self._entry(page))), _TO_OWN,
                              self._unmarked[self._group(page)])
        return tree if count == 1 else None


def add_quick_navigation(app):
    """
    Hand the theme a tree of titles that copies no heading within a page.

    Sphinx copies the whole contents of all pages for each of them, and then drops what is no
    title. Here the tree is open along the branch of the page only; the others are a click away.
    Beside a page whose tree is made already, only the mark of the page itself is moved.
    """
    titles, made = {}, []

    def of_page(app, pagename, templatename, context, doctree):
        tree, env = context.get('toctree'), app.env
        if tree is None:
            return
        if not made:
            made.append(_Neighbours(app))

        def quick_tree(**options):
            if not options.get('titles_only'):
                return tree(**options)
            if made[0].tree(pagename):
                return ''
            if not titles:
                titles.update((name, _with_titles(toc)) for name, toc in env.tocs.items())
            whole, env.tocs = env.tocs, titles
            try:
                return tree(**options | {'collapse': True})
            finally:
                env.tocs = whole

        context['toctree'] = quick_tree

    def with_its_mark(app, pagename, templatename, context, doctree):
        if context.get('furo_navigation_tree'):
            made[0].keep(pagename, context['furo_navigation_tree'])
        elif made:
            context['furo_navigation_tree'] = made[0].tree(pagename) or ''

    # The theme asks at the usual priority, 500.
    app.connect('html-page-context', of_page, priority=400)
    app.connect('html-page-context', with_its_mark, priority=600)
