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


def copies(root, target):
    """Return the path below docs/ and the text of every page from outside, links changed."""
    sources = [*sorted((root / 'msg_docs').glob('*.md')), root / 'CONTRIBUTING.md']
    made = {}
    for path in sources:
        place = site_place(path.relative_to(root).as_posix())
        made[place] = with_site_links(
            path.read_text(encoding='utf-8'), path.relative_to(root).as_posix(), place, root,
            target)
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


def with_site_links(text, source, place, root, target):
    """
    Return a text of the file ``source`` of the repository with links that hold in the site.

    ``place`` is the page below ``target``. A file that has no page can be downloaded.
    """
    def changed(match):
        path = os.path.normpath(os.path.join(os.path.dirname(source), match[1]))
        page = site_place(path)
        if page is None:
            return f'path:{os.path.relpath(root / path, (target / place).parent)}'
        return os.path.relpath(page, os.path.dirname(place) or '.')
    return _LINK.sub(changed, text)
