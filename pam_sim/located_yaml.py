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
YAML that remembers where every value stands, for errors a person can act on.

Numbers follow YAML 1.2: ``2e-10`` is a number, ``on`` is a text. Duplicate keys are refused.
:class:`Located` checks type, range and spelling, with file and line in the message.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping
import functools
import math
import os
import re
from typing import Any, Self

from pam_sim.declared import shown
from pam_sim.errors import did_you_mean, InputError
from pam_sim.files import refuse_pipe, StrPath
from pam_sim.units import allowed_range
from pam_sim.yaml_nodes import composed, Loader, MAX_DEPTH
import yaml

# Bounds of what is read at all. The largest file of this kind holds some 10 kB and 500 values.
MAX_BYTES = 300_000
MAX_VALUES = 50_000       # counted where aliases put them, so that few bytes cannot become many
_WHOLE = re.compile(r'[-+]?[0-9]+')
_COMMA = re.compile(r'[-+]?[0-9]+,[0-9]+')
_NO_TEXT = re.compile('[\0\ud800-\udfff]')


class Located(Mapping[str, Any]):
    """
    A YAML mapping that knows the line of each of its keys.

    Read it like a dict; values that are mappings are ``Located`` themselves,
    values that are sequences are :class:`LocatedList`.

    Parameters
    ----------
    values : dict
        Key to value.
    lines : dict
        Key to line number, counted from 1.
    name : str
        File name used in messages.
    line : int
        Line on which the mapping itself begins.

    """

    def __init__(
            self, values: Mapping[str, Any], lines: Mapping[str, int] | None = None,
            name: str = '<text>', line: int = 1) -> None:
        self._values = dict(values)
        self._lines = dict(lines or {})
        self.name = name
        self.line = line

    def __getitem__(self, key: str) -> Any:
        """Return the value of a key."""
        return self._values[key]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the keys in file order."""
        return iter(self._values)

    def __len__(self) -> int:
        """Return the number of keys."""
        return len(self._values)

    def where(self, key: str | None = None) -> str:
        """Return ``file:line`` of a key, or of the mapping itself."""
        line = self.line if key is None else self._lines.get(key, self.line)
        return f'{self.name}:{line}'

    def error(self, problem: str, key: str | None = None) -> InputError:
        """Return an ``InputError`` placed at a key, ready to be raised."""
        return InputError(problem, self.where(key))

    def check_keys(self, allowed: Iterable[str], what: str = 'key') -> Self:
        """
        Refuse keys that are not in ``allowed``.

        Raises
        ------
        InputError
            With place, the nearest allowed spelling and all allowed keys.

        """
        allowed = list(allowed)
        for key in self._values:
            if key not in allowed:
                raise self.error(
                    f'unknown {what} `{key}`{did_you_mean(key, allowed)}; allowed: '
                    f'{", ".join(allowed) or "none"}', key)
        return self

    def require(
            self, key: str, type: type | None = None,  # noqa: A002
            lower: float | None = None,
            upper: float | None = None, choices: Collection[Any] | None = None,
            unit: str = '') -> Any:
        """
        Return a value that must be there.

        Parameters
        ----------
        key : str
            Key in this mapping.
        type : type, optional
            ``float`` (takes integers, refuses nan, inf and booleans), ``int``,
            ``str``, ``bool``, ``Located``/``dict`` or ``LocatedList``/``list``.
        lower, upper : float, optional
            Inclusive range of a number.
        choices : sequence, optional
            The values allowed.
        unit : str
            Unit shown in the message.

        Raises
        ------
        InputError
            Missing key, wrong type, out of range or not among the choices.

        """
        if key not in self._values:
            raise self.error(f'`{key}` is missing')
        return check_value(
            self._values[key], f'`{key}`', self.where(key), type, lower, upper, choices, unit)

    def get(  # type: ignore[override]  # of a Mapping: the second argument is the default
            self, key: str, type: type | None = None, default: Any = None,  # noqa: A002
            lower: float | None = None, upper: float | None = None,
            choices: Collection[Any] | None = None, unit: str = '') -> Any:
        """Return a checked value as :meth:`require` does, or ``default`` if the key is absent."""
        if key not in self._values:
            return default
        return self.require(key, type, lower, upper, choices, unit)

    def copy(self) -> 'Located':
        """Return a copy, with copies of all mappings and sequences below."""
        return Located({key: _copied(value) for key, value in self._values.items()}, self._lines,
                       self.name, self.line)

    def with_(self, **values: Any) -> 'Located':
        """Return a copy with other values of some keys, which keep their lines."""
        return Located({**self.copy(), **values}, self._lines, self.name, self.line)

    def plain(self) -> dict[str, Any]:
        """Return nested plain dicts and lists."""
        return {key: _plain(value) for key, value in self._values.items()}


class LocatedList(list[Any]):
    """A YAML sequence that knows the line of each item."""

    def __init__(
            self, items: Iterable[Any] = (), lines: Iterable[int] = (), name: str = '<text>',
            line: int = 1) -> None:
        super().__init__(items)
        self._lines = list(lines)
        self.name = name
        self.line = line

    def copy(self) -> 'LocatedList':
        """Return a copy, with copies of all mappings and sequences below."""
        return LocatedList(map(_copied, self), self._lines, self.name, self.line)

    def where(self, index: int | None = None) -> str:
        """Return ``file:line`` of an item, or of the sequence itself."""
        if index is None or not 0 <= index < len(self._lines):
            return f'{self.name}:{self.line}'
        return f'{self.name}:{self._lines[index]}'

    def require(
            self, index: int, type: type | None = None,  # noqa: A002
            lower: float | None = None,
            upper: float | None = None, choices: Collection[Any] | None = None,
            unit: str = '') -> Any:
        """Return item ``index`` checked as :meth:`Located.require` does."""
        if not 0 <= index < len(self):
            raise InputError(f'item {index + 1} is missing', self.where())
        return check_value(
            self[index], f'item {index + 1}', self.where(index), type, lower, upper, choices, unit)


_TYPE_NAMES = {float: 'a number', int: 'a whole number', str: 'a text', bool: 'true or false',
               dict: 'a mapping (key: value)', list: 'a list'}
# Those named in `require` for what is checked as a plain dict or list.
_PLAIN_TYPES: dict[type | None, type | None] = {Located: dict, LocatedList: list}


def _has_type(value: object, wanted: type) -> bool:
    if wanted is float:
        return (isinstance(value, (int, float)) and not isinstance(value, bool)
                and math.isfinite(value))
    if wanted is int:
        return isinstance(value, int) and not isinstance(value, bool)
    if wanted is dict:
        return isinstance(value, Mapping)
    return isinstance(value, wanted)


def check_value(
        value: Any, what: str, where: str, type: type | None = None,  # noqa: A002
        lower: float | None = None,
        upper: float | None = None, choices: Collection[Any] | None = None, unit: str = '') -> Any:
    """
    Return ``value`` (a number as ``float`` where ``type`` is float) or raise.

    ``what`` names the value in the message, ``where`` is its place; the other
    arguments are those of :meth:`Located.require`.

    Raises
    ------
    InputError
        Wrong type, out of range or not among the choices.

    """
    wanted = _PLAIN_TYPES.get(type, type)
    if wanted is not None and not _has_type(value, wanted):
        raise InputError(
            f'{what} must be {_TYPE_NAMES.get(wanted, wanted.__name__)}, not {_shown(value)}'
            + _range_text(lower, upper, unit), where)
    if choices is not None and value not in choices:
        raise InputError(
            f'{what} is {_shown(value)}{_near(value, choices)}, allowed: '
            f'{", ".join(map(str, choices))}', where)
    if lower is not None and value < lower or upper is not None and value > upper:
        raise InputError(f'{what} is {value!r}' + _range_text(lower, upper, unit), where)
    return float(value) if wanted is float else value


def _near(value: object, choices: Collection[object]) -> str:
    return did_you_mean(value, choices) if isinstance(value, str) else ''


def _shown(value: object) -> str:
    if isinstance(value, Mapping):
        return 'a mapping'
    if isinstance(value, list):
        return 'a list'
    return f'`{value}`' if isinstance(value, str) else repr(value)


def _range_text(lower: float | None, upper: float | None, unit: str) -> str:
    unit = f' {unit}' if unit else ''
    if lower is not None and upper is not None:
        return f'; allowed {allowed_range(lower, upper, unit.strip())}'
    if lower is not None:
        return f'; allowed from {lower:g}{unit}'
    return f'; allowed up to {upper:g}{unit}' if upper is not None else ''


def _copied(value: Any) -> Any:
    return value.copy() if isinstance(value, (Located, LocatedList)) else value


def _plain(value: Any) -> Any:
    if isinstance(value, Located):
        return value.plain()
    if isinstance(value, list):
        return [_plain(item) for item in value]
    return value


def path_text(path: StrPath, what: str = 'name, path or YAML text') -> str:
    """Return a path as text; raise InputError for what is none, with words for ``what`` is."""
    if not isinstance(path, (str, os.PathLike)):
        raise InputError(f'{shown(path)} is no {what}')
    return os.fspath(path)


def load_yaml(path_or_text: StrPath, name: str | None = None) -> Located:
    """
    Read a YAML mapping with the place of every value.

    Parameters
    ----------
    path_or_text : str or os.PathLike
        A file, or YAML text (recognised by a line break or a ``key: value``).
    name : str, optional
        Name shown in messages; the file name by default.

    Returns
    -------
    Located

    Raises
    ------
    InputError
        Missing file, not UTF-8 text, not YAML, duplicate key, not a mapping, or more than
        anybody writes by hand (``MAX_BYTES``, ``MAX_VALUES``, ``MAX_DEPTH``).

    """
    if isinstance(path_or_text, str) and (
            '\n' in path_or_text or ': ' in path_or_text) and not os.path.exists(path_or_text):
        raw, name = path_or_text.encode('utf-8', 'surrogatepass'), name or '<text>'
    else:
        path = path_text(path_or_text)
        name = name or path
        raw = _read(path, name)
    if len(raw) > MAX_BYTES:
        raise InputError(f'is larger than {MAX_BYTES // 1000} kB, which no file of this kind is',
                         name)
    try:
        text = raw.decode('utf-8')
    except UnicodeDecodeError as error:
        raise InputError('is not a text file (UTF-8 expected)',
                         _line_at(name, raw[:error.start])) from error
    return _parsed(text, name).copy()


@functools.lru_cache(maxsize=64)        # presets, and what a bag holds, are read again and again
def _parsed(text: str, name: str) -> Located:
    """Return the mapping that a text is."""
    try:
        loader, node = composed(text)
        if node is None:
            raise InputError('is empty; a mapping (key: value) is expected', f'{name}:1')
        if not isinstance(node, yaml.MappingNode):
            raise InputError('a mapping (key: value) is expected',
                             f'{name}:{node.start_mark.line + 1}')
        mapping: Located = _Conversion(loader, name).convert(node)
        return mapping
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = f':{mark.line + 1}' if mark else ''
        raise InputError(f'is not valid YAML: {error.problem}', f'{name}{line}') from error
    except yaml.reader.ReaderError as error:
        raise InputError('holds a character that is not text',
                         _line_at(name, text[:error.position].encode())) from error


def _read(path: str, name: str) -> bytes:
    """Return the bytes of a file, or what shows that it is too large."""
    refuse_pipe(path)
    try:
        with open(path, 'rb') as file:
            return file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:      # ValueError: a path with a null character
        why = getattr(error, 'strerror', None) or error
        raise InputError(f'cannot be read ({why})', name) from error


def _line_at(name: str, before: bytes) -> str:
    """Return ``file:line`` of what follows some bytes."""
    return f'{name}:{before.count(10) + 1}'     # 10: line feed


class _Conversion:
    """YAML nodes to located values, with a limit on their number and depth."""

    def __init__(self, loader: Loader, name: str) -> None:
        self._loader, self._name = loader, name
        self._left = MAX_VALUES

    def convert(self, node: yaml.Node, depth: int = 0) -> Any:
        """Return the value of a node and of everything below it."""
        line = node.start_mark.line + 1
        self._left -= 1
        if self._left < 0 or depth > MAX_DEPTH:
            raise InputError(
                f'holds more than {MAX_VALUES} values or {MAX_DEPTH} levels once its aliases '
                'are followed', f'{self._name}:{line}')
        if isinstance(node, yaml.MappingNode):
            return self._mapping(node, line, depth)
        if isinstance(node, yaml.SequenceNode):
            return LocatedList(
                [self.convert(item, depth + 1) for item in node.value],
                [item.start_mark.line + 1 for item in node.value], self._name, line)
        assert isinstance(node, yaml.ScalarNode)
        return self._scalar(node)

    def _mapping(self, node: yaml.MappingNode, line: int, depth: int) -> Located:
        values, lines = {}, {}
        before = None
        for key_node, value_node in node.value:
            key_line = key_node.start_mark.line + 1
            if node.flow_style and before is not None:
                self._check_comma(before, key_node, value_node, key_line)
            before = key_node, value_node
            if not isinstance(key_node, yaml.ScalarNode):
                raise InputError('a key must be a plain word', f'{self._name}:{key_line}')
            key = self._scalar(key_node)
            if key in values:
                raise InputError(f'`{key}` is given twice', f'{self._name}:{key_line}')
            values[key] = self.convert(value_node, depth + 1)
            lines[key] = key_line
        return Located(values, lines, self._name, line)

    def _check_comma(
            self, before: tuple[yaml.Node, yaml.Node], key_node: yaml.Node, value_node: yaml.Node,
            line: int) -> None:
        """Refuse ``{mass_kg: 3,5}``, which to YAML is the key ``5`` without a value."""
        texts = [one.value for one in (before[1], key_node, value_node)]
        together = key_node.start_mark.index == before[1].end_mark.index + 1
        if together and all(isinstance(text, str) for text in texts) and texts[2] == '' \
                and _WHOLE.fullmatch(texts[0]) and texts[1].isdecimal():
            raise InputError(
                f'`{before[0].value}: {texts[0]},{texts[1]}` has a decimal comma; write a decimal '
                f'point: {texts[0]}.{texts[1]}', f'{self._name}:{line}')

    def _scalar(self, node: yaml.ScalarNode) -> Any:
        where = f'{self._name}:{node.start_mark.line + 1}'
        if not node.style and _COMMA.fullmatch(node.value):
            raise InputError(
                f'`{node.value}` has a comma; write a decimal point and no separators: '
                f'{node.value.replace(",", ".", 1)}', where)
        try:
            value = self._loader.construct_object(node)
        except yaml.YAMLError:
            raise
        except Exception as error:
            # A tag such as !!float in front of a text that is none; each tag fails its own way.
            raise InputError(f'`{node.value[:40]}` does not fit its tag {node.tag}',
                             where) from error
        if isinstance(value, str) and _NO_TEXT.search(value):
            raise InputError('holds a character that is not text', where)
        return value


def dump_yaml(data: Mapping[str, Any]) -> str:
    """Return deterministic YAML text of nested dicts, lists and scalars (keys keep order)."""
    plain = _dumpable(data)
    return str(yaml.dump(
        plain, Dumper=_FAST_DUMPER if _is_simple(plain) else yaml.SafeDumper, sort_keys=False,
        default_flow_style=False, allow_unicode=True, width=99))


# libyaml takes a tenth of the time. It writes long keys, and texts to be escaped, another way.
_FAST_DUMPER: type[Any] = getattr(yaml, 'CSafeDumper', yaml.SafeDumper)
_LONGEST_KEY = 60


def _is_simple(value: Any) -> bool:
    """Return whether libyaml writes the same bytes as Python: keys and texts are plain ASCII."""
    if isinstance(value, dict):
        return all(isinstance(key, str) and 0 < len(key) <= _LONGEST_KEY and _is_simple(key)
                   and _is_simple(item) for key, item in value.items())
    if isinstance(value, list):
        return all(_is_simple(item) for item in value)
    return not isinstance(value, str) or value.isascii() and value.isprintable()


def _dumpable(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _dumpable(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_dumpable(item) for item in value]
    if hasattr(value, 'tolist'):      # numpy scalars and arrays
        return _dumpable(value.tolist())
    return value
