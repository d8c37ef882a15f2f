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

"""Presets: YAML files of one folder of the package, each found by its name."""

import os
from pathlib import Path

from pam_sim.errors import did_you_mean, InputError
from pam_sim.files import StrPath
from pam_sim.located_yaml import load_yaml, Located

_HERE = Path(__file__).parent


def file_stem(source: StrPath | Located) -> str | None:
    """Return the name of a file without folder and ending; None for a text or a mapping."""
    if isinstance(source, Located) or isinstance(source, str) and (
            '\n' in source or ': ' in source) and not os.path.exists(source):
        return None
    return Path(source).stem


class NamedFiles:
    """
    The YAML files of a folder.

    Parameters
    ----------
    folder : str
        Inside this package.

    """

    def __init__(self, folder: str) -> None:
        self._folder = _HERE / folder

    def names(self) -> list[str]:
        """Return the names, sorted."""
        return sorted(path.stem for path in self._folder.glob('*.yaml'))

    def read(self, name: str) -> Located:
        """Return the content of a file as a Located mapping."""
        path = self._folder / f'{name}.yaml'
        return load_yaml(path.read_text(encoding='utf-8'), name=path.name)

    def locate(self, source: StrPath | Located, what: str) -> tuple[Located, str | None]:
        """
        Return (content, name): of a preset, a file or a text; the name is None but for a preset.

        Parameters
        ----------
        source : str, os.PathLike or Located
            Preset name, path, YAML text, or a mapping already read.
        what : str
            What is looked for, for the message.

        Raises
        ------
        InputError
            Neither a preset nor a file, or no YAML.

        """
        if isinstance(source, Located):
            return source, None
        if isinstance(source, str):
            if source in self.names():
                return self.read(source), source
            if '\n' not in source and not os.path.exists(source) \
                    and ': ' not in source and not source.endswith(('.yaml', '.yml')):
                raise InputError(
                    f'{what} `{source}` is neither a preset nor a file'
                    f'{did_you_mean(source, self.names())}; presets: ' + ', '.join(self.names()))
        return load_yaml(source), None
