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

"""Puts together what Sphinx reads: the pages of docs/, those from outside, the generated ones."""

from generate import api, command_line, json_files, outside, yaml_files

# What is no page, in docs/.
_LEFT_OUT = ('generate', 'conf.py', '__pycache__')


def write_all(root, source, target):
    """
    Write everything that Sphinx reads below ``target``.

    ``source`` is docs/, or a copy of it made by rosdoc2. Files that have not changed are kept, so
    that Sphinx reads only what is new. Files that are no longer made are removed.
    """
    made = {
        path.relative_to(source).as_posix(): path.read_bytes()
        for path in source.rglob('*')
        if path.is_file() and not set(path.relative_to(source).parts) & set(_LEFT_OUT)}
    for name, data in made.items():
        if name.endswith('.md'):
            text = outside.with_site_links(data.decode(), f'docs/{name}', name, root, target)
            made[name] = text.encode()
    generated = {
        **outside.copies(root, target), **api.pages(root), **command_line.pages(),
        **yaml_files.pages(), **json_files.pages()}
    made.update((name, text.encode()) for name, text in generated.items())
    for name, data in made.items():
        path = target / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.is_file() or path.read_bytes() != data:
            path.write_bytes(data)
    for path in target.rglob('*'):
        if path.is_file() and path.relative_to(target).as_posix() not in made:
            path.unlink()
