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

"""Settings of the documentation: ``make docs`` builds it with Sphinx into build/docs."""

from collections import defaultdict
from functools import cached_property, lru_cache
import gc
import importlib.util
import logging
from pathlib import Path
import sys

HERE = Path(__file__).resolve().parent
# rosdoc2 builds a copy of this folder; the packages then say where the repository is.
if not (HERE.parent / 'msg_docs').is_dir():
    ROOT = Path(importlib.util.find_spec('pam_actuation').origin).resolve().parents[1]
else:
    ROOT = HERE.parent
sys.path[:0] = [str(ROOT), str(ROOT / 'docs')]

from generate import pages                      # noqa: E402
from generate.mathml import add_mathml          # noqa: E402
from generate.navigation import add_quick_navigation    # noqa: E402
from generate.tree_search import search_quickly         # noqa: E402
from pam_actuation import __version__           # noqa: E402
from sphinx.domains.python import PythonDomain  # noqa: E402
from sphinx.search.en import SearchEnglish      # noqa: E402

# The trees of all pages are kept: looks for garbage among them took a quarter of the time.
gc.set_threshold(1_000_000, 50, 50)
search_quickly()

project = 'pam_actuation'
author = 'pam_actuation developers'
copyright = '2026 pam_actuation developers'  # noqa: A001
version = release = __version__

extensions = ['myst_nb']
root_doc = 'index'
exclude_patterns = ['static']

myst_enable_extensions = ['dollarmath', 'colon_fence', 'deflist']
myst_heading_anchors = 4
# A test runs the notebooks; the pages show the outputs they hold.
nb_execution_mode = 'off'
myst_dmath_double_inline = True
# Two classes of one name in different modules: a type in a signature may lead to either.
suppress_warnings = ['ref.python']

# Furo brings its own style sheets and fonts of the system: nothing is fetched from a network.
html_theme = 'furo'
html_title = f'pam_actuation {__version__}'
html_static_path = ['static']
html_css_files = ['site.css']
html_show_sphinx = False
html_copy_source = False
html_theme_options = {'navigation_with_keys': True}
pygments_style = 'friendly'
pygments_dark_style = 'native'
toc_object_entries = False
# Quotes and hyphens are shown as they are written.
smartquotes = False
python_use_unqualified_type_names = True
maximum_signature_line_length = 80


class RememberingDomain(PythonDomain):
    """Python's domain that looks a name up once, and only among those that end like it."""

    _alike = None

    @property
    def objects(self):
        """Return all objects by full name; while a name is looked up, those that end like it."""
        return super().objects if self._alike is None else self._alike

    @cached_property
    def _by_last_part(self):
        """Return the objects by the last part of their names, in the order of all."""
        found = defaultdict(dict)
        for name, entry in self.objects.items():
            found[name.rpartition('.')[2]][name] = entry
        return found

    # One domain per build, whose names are complete before the first is looked up.
    @lru_cache(maxsize=None)    # noqa: B019
    def find_obj(self, env, modname, classname, name, *more):
        """Return the objects that a name may mean: a type stands in hundreds of signatures."""
        self._alike = self._by_last_part.get(name.removesuffix('()').rpartition('.')[2], {})
        try:
            return super().find_obj(env, modname, classname, name, *more)
        finally:
            self._alike = None


class RememberingEnglish(SearchEnglish):
    """The English of the search index: the stem of a word is found once, not for each page."""

    stem = lru_cache(maxsize=None)(SearchEnglish.stem)


def setup(app):
    """Put the pages together beside the output: docs/ holds only what is written by hand."""
    if not app.verbosity:       # thousands of remarks that nobody reads
        logging.getLogger('sphinx').setLevel(logging.INFO)
    target = Path(app.doctreedir).resolve() / 'source'
    pages.write_all(ROOT, Path(app.srcdir), target)
    app.srcdir = target
    add_mathml(app)
    add_quick_navigation(app)
    app.add_domain(RememberingDomain, override=True)
    app.add_search_language(RememberingEnglish)
    # At the end the interpreter would look for garbage among all pages.
    app.connect('build-finished', lambda *_: gc.freeze())
