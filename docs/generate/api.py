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

"""
A page per folder of the packages with every public name, read from the sources.

Nothing is imported: signatures, annotations and docstrings are taken from the syntax tree, so
compiled functions show theirs as well.
"""

import ast
import re

from sphinx.ext.napoleon import Config, NumpyDocstring

PACKAGES = ('pam_sim', 'pam_actuation')
_SETTINGS = Config(
    napoleon_use_rtype=False, napoleon_use_param=False,
    napoleon_custom_sections=[('Attributes', 'params_style')])
_LITERAL = re.compile(r'(``(?! ).+?``)', re.S)
# A role that Python knows, such as :func:`name`: its name is shown as a literal.
_ROLE = re.compile(r':(?:mod|class|func|meth|data|attr|exc|obj):`~?([^`]+)`')
# What reStructuredText would take for the begin or end of markup in a plain sentence.
_MARKUP = re.compile(r'[|`]|\*(?=\S)|(?<=\S)\*|(?<=\w)_(?!\w)')
_INDEX = """Python interface
================

Every public name of both packages, one page for each folder. ``pam_sim`` is the physics and
needs no ROS. ``pam_actuation`` is everything around it; only its nodes need ROS. A name with a
leading underscore is private and not listed.

"""


def pages(root):
    """Return the path below docs/ and the text of each page."""
    made, names = {}, []
    for package in PACKAGES:
        folders = sorted({path.parent for path in (root / package).rglob('*.py')})
        for folder in folders:
            dotted = '.'.join(folder.relative_to(root).parts)
            text = page(dotted, folder)
            if text and not any(part.startswith('_') for part in dotted.split('.')):
                made[f'reference/api/{dotted}.rst'] = text
                names.append(dotted)
    tree = ''.join(f'   {name}\n' for name in names)
    made['reference/api/index.rst'] = f'{_INDEX}.. toctree::\n   :maxdepth: 1\n\n{tree}'
    return made


def public_names(tree):
    """Return the public functions, classes and constants of a module, in their order."""
    found = []
    for node in tree.body:
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            found.append((node.name, node))
        elif isinstance(node, (ast.Assign, ast.AnnAssign)):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            found += [(t.id, node) for t in targets if isinstance(t, ast.Name)]
    return [(name, node) for name, node in dict(found).items() if not name.startswith('_')]


def page(dotted, folder):
    """Return the page of a folder, or an empty text if it has no public names."""
    parts = []
    for path in sorted(folder.glob('*.py')):
        if path.stem.startswith('_') and path.stem != '__init__':
            continue
        tree = ast.parse(path.read_text(encoding='utf-8'))
        name = dotted if path.stem == '__init__' else f'{dotted}.{path.stem}'
        parts.append(_module(name, tree))
    whole = '\n\n'.join(part for part in parts if part)
    return f'{dotted}\n{"=" * len(dotted)}\n\n{whole}\n' if whole else ''


def _module(name, tree):
    entries = [_entry(label, node) for label, node in public_names(tree)]
    text = _prose(ast.get_docstring(tree) or '')
    if not entries and not text:
        return ''
    head = f'{name}\n{"-" * len(name)}\n\n.. py:module:: {name}\n\n' + text
    return '\n\n'.join([head, *(entry for entry in entries if entry)])


def _entry(name, node):
    if isinstance(node, ast.ClassDef):
        bases = ', '.join(ast.unparse(base) for base in node.bases)
        made = [_directive('class', name, _init_signature(node), _doc(node)
                           + (f'\n\nBases: ``{bases}``' if bases else ''))]
        for label, member in public_names(node):
            made.append(_indented(_member(label, member)))
        return '\n\n'.join(made)
    return _member(name, node, top=True)


def _member(name, node, top=False):
    if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
        marks = {ast.unparse(d).partition('(')[0] for d in node.decorator_list}
        arguments = ast.unparse(node.args)
        if top:
            kind = 'function'
        elif marks & {'property', 'cached_property', 'functools.cached_property'}:
            return _directive('property', name, '', _doc(node))
        else:
            kind = 'method'
            if 'staticmethod' not in marks:
                arguments = re.sub(r'^(self|cls)(, )?', '', arguments)
        returned = f' -> {ast.unparse(node.returns)}' if node.returns else ''
        return _directive(kind, name, f'({arguments}){returned}', _doc(node))
    if isinstance(node, ast.ClassDef):
        return _directive('class', name, '', _doc(node))
    return _directive('data' if top else 'attribute', name, '', _value(node))


def _value(node):
    parts = []
    if isinstance(node, ast.AnnAssign):
        parts.append(f':type: {ast.unparse(node.annotation)}')
    if node.value is not None:
        text = ast.unparse(node.value)
        if len(text) <= 60:
            parts.append(f':value: {text}')
    return '\n'.join(parts)


def _init_signature(node):
    for member in node.body:
        if isinstance(member, ast.FunctionDef) and member.name == '__init__':
            return f'({re.sub(r"^self(, )?", "", ast.unparse(member.args))})'
    if any('dataclass' in ast.unparse(d) for d in node.decorator_list):
        fields = [m for m in node.body if isinstance(m, ast.AnnAssign)]
        shown = [f'{f.target.id}: {ast.unparse(f.annotation)}' for f in fields]
        return f'({", ".join(shown)})' if sum(map(len, shown)) < 300 else ''
    return ''


def _directive(kind, name, signature, body):
    return f'.. py:{kind}:: {name}{signature}\n{_indented(body)}'


def _doc(node):
    text = _prose(ast.get_docstring(node) or '')
    return f'\n{text}' if text else ''


def _prose(docstring):
    """Return a docstring as reStructuredText: sections of numpydoc changed, nothing else."""
    return str(NumpyDocstring(_escaped(docstring), _SETTINGS)) if docstring else ''


def _escaped(text):
    """Return a docstring in which only literals, lists and sections are markup."""
    paragraphs, literal = [], False
    for paragraph in text.split('\n\n'):
        if not (literal and paragraph.startswith((' ', '\t'))):
            literal = paragraph.endswith('::')
            parts = _LITERAL.split(_ROLE.sub(r'``\1``', paragraph))
            parts[::2] = [_MARKUP.sub(r'\\\g<0>', part) for part in parts[::2]]
            paragraph = ''.join(parts)
        paragraphs.append(paragraph)
    return '\n\n'.join(paragraphs)


def _indented(text):
    return '\n'.join(f'   {line}' if line else '' for line in text.splitlines())
