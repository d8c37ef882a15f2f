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

"""Writes all generated pages of the documentation; a page that has not changed is kept."""

from generate import api, command_line, outside

# What is made anew with every build, below docs/ (not in the repository).
FOLDERS = ('reference/api', 'reference/cli', 'reference/topics', 'project')


def write_all(root, target):
    """Write the generated pages below ``target``, the folder of the sources of the site."""
    made = {**outside.copies(root), **api.pages(root), **command_line.pages()}
    for name, text in made.items():
        path = target / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.is_file() or path.read_text(encoding='utf-8') != text:
            path.write_text(text, encoding='utf-8')
    for folder in FOLDERS:
        for path in (target / folder).rglob('*.*'):
            if path.relative_to(target).as_posix() not in made:
                path.unlink()
