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

from sphinx import addnodes


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


def add_quick_navigation(app):
    """
    Hand the theme a tree of titles that copies no heading within a page.

    Sphinx copies the whole contents of all pages for each of them, and then drops what is no
    title. Here the tree is open along the branch of the page only; the others are a click away.
    """
    titles = {}

    def of_page(app, pagename, templatename, context, doctree):
        tree, env = context.get('toctree'), app.env
        if tree is None:
            return

        def quick_tree(**options):
            if not options.get('titles_only'):
                return tree(**options)
            if not titles:
                titles.update((name, _with_titles(toc)) for name, toc in env.tocs.items())
            whole, env.tocs = env.tocs, titles
            try:
                return tree(**options | {'collapse': True})
            finally:
                env.tocs = whole

        context['toctree'] = quick_tree

    # The theme asks at the usual priority, 500.
    app.connect('html-page-context', of_page, priority=400)
