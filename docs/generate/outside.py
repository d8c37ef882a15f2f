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

"""Pages that stand outside of docs/: their copies in the site, and links to and from them."""

import os
from pathlib import Path
import re

# Folder or file of the repository -> its place below docs/.
PLACES = {
    'msg_docs/README.md': 'reference/topics/index.md',
    'msg_docs': 'reference/topics',
    'CONTRIBUTING.md': 'project/contributing.md',
    'CHANGELOG.rst': 'project/changelog.rst',
    'README.md': 'index.md',
}
_LINK = re.compile(r'(?<=\]\()([^)#\s:]+)(?=[)#])')


def copies(root):
    """Return the path below docs/ and the text of every page from outside, links changed."""
    sources = [*sorted((root / 'msg_docs').glob('*.md')), root / 'CONTRIBUTING.md']
    made = {}
    for path in sources:
        place = site_place(path.relative_to(root).as_posix())
        made[place] = with_site_links(
            path.read_text(encoding='utf-8'), path.relative_to(root).as_posix(), place)
    made['project/changelog.rst'] = (root / 'CHANGELOG.rst').read_text(encoding='utf-8')
    topics = ''.join(f'{path.stem}\n' for path in sources if path.parent.name == 'msg_docs'
                     and path.stem != 'README')
    made['reference/topics/index.md'] += f'\n```{{toctree}}\n:hidden:\n\n{topics}```\n'
    return made


def site_place(path):
    """Return where a file of the repository stands below docs/, or None."""
    for outside, place in PLACES.items():
        if path == outside:
            return place
        if path.startswith(f'{outside}/'):
            return place + path[len(outside):]
    return path[len('docs/'):] if path.startswith('docs/') else None


def with_site_links(text, source, place):
    """
    Return a text of the file ``source`` with links that hold at ``place`` below docs/.

    A file that has no page in the site can be downloaded from it.
    """
    def changed(match):
        path = os.path.normpath(os.path.join(os.path.dirname(source), match[1]))
        target = site_place(path)
        folder = os.path.dirname(place)
        if target is None:
            return f"path:{os.path.relpath(Path('..') / path, folder or '.')}"
        return os.path.relpath(target, folder or '.')
    return _LINK.sub(changed, text)


def links_into_site(app, docname, source):
    """Sphinx event: lead links of pages in docs/ to the copies of pages outside of it."""
    if app.env.doc2path(docname).endswith('.md') and not docname.startswith(
            ('reference/topics/', 'project/')):
        source[0] = with_site_links(source[0], f'docs/{docname}.md', f'{docname}.md')
