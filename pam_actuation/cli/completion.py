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
Completion of the command line in a shell: verbs, options, and names of what there is.

argcomplete starts ``pam`` at every press of the tab key, so nothing here imports the simulator.
"""

import argparse
from collections.abc import Callable
import os
from typing import Any, TYPE_CHECKING

if TYPE_CHECKING:
    from pam_actuation.cli.options import Parser

# Folders of pam_sim; of what is registered by its file also where further ones are, and a name
# that each file assigns.
RIG, JOINT, MUSCLE = 'presets', 'joint/presets', 'muscle/sizes'
REGULATOR = 'valve/regulators'
LAW = 'muscle/laws', 'PAM_MUSCLE_LAWS_PATH', 'LAW'
LOAD = 'load', 'PAM_LOADS_PATH', 'NAME'
EFFECT = 'effects', 'PAM_EFFECTS_PATH', 'EFFECT'
# What models have beside files of presets, laws, loads and effects.
BUILT_IN = ('antagonistic_joint', 'bore', 'hsv', 'law', 'ppr', 'sensors')
ASKED = '_ARGCOMPLETE'      # in the environment while a shell asks


def asked() -> bool:
    """Return whether it is a shell that starts this process, to complete a command line."""
    return ASKED in os.environ


def complete(parser: 'Parser') -> None:
    """Answer the shell and end the process if it is a shell that asks; else do nothing."""
    if not asked():
        return
    import argcomplete
    _add_names(parser)
    argcomplete.autocomplete(parser)


def _add_names(parser: argparse.ArgumentParser) -> None:
    """Give every argument of every verb that takes a name the names there are."""
    for verb, sub in verbs_of(parser).items():
        for action in sub._actions:
            names = _names_for(verb, action.dest)
            if names is not None:
                setattr(action, 'completer', _with_files(names))  # noqa: B010, of argcomplete


Names = Callable[[], list[str]]


def verbs_of(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """Return name to parser of all verbs."""
    return next(action.choices for action in parser._actions
                if isinstance(action.choices, dict))


def _names_for(verb: str, argument: str) -> Names | None:
    """Return the function that lists the names of an argument, None for one without names."""
    if argument == 'valve':
        from pam_sim.valve import VALVES
        return lambda: list(VALVES)
    if argument in ('experiment', 'check') or (verb, argument) == ('experiments', 'name'):
        return lambda: configured('experiments')
    if argument in ('controller', 'changes', 'against') or (verb, argument) == ('rules', 'rules'):
        return lambda: configured('controllers')
    if argument == 'hardware':
        return lambda: configured('hardware')
    if (verb, argument) in (('up', 'model'), ('rules', 'rig')):
        return lambda: presets(RIG) + presets(JOINT)
    if argument in ('rig', 'model', 'simulate'):
        return lambda: presets(RIG)
    if (verb, argument) in (('nodes', 'name'), ('status', 'name'), ('param', 'node')):
        return nodes
    if (verb, argument) == ('models', 'name'):
        return lambda: [*BUILT_IN, *presets(RIG), *presets(JOINT), *presets(MUSCLE),
                        *declared(*LAW), *declared(*LOAD), *declared(*EFFECT)]
    if verb == 'rig' and argument in OF_RIG:
        return OF_RIG[argument]
    return None


def configured(kind: str) -> list[str]:
    """Return the names in one folder of ``config``."""
    from pam_actuation.resources import list_config
    return list_config(kind)


def presets(folder: str) -> list[str]:
    """Return the names of presets in one folder of ``pam_sim``."""
    from pam_sim.named_files import NamedFiles
    return NamedFiles(folder).names()


def declared(folder: str, variable: str, mark: str) -> list[str]:
    """
    Return the names of laws, loads or effects, each a file with a certain line.

    Parameters
    ----------
    folder : str
        Of ``pam_sim``.
    variable : str
        Environment variable with further folders.
    mark : str
        The name that each such file assigns.

    """
    from pathlib import Path

    import pam_sim
    own = str(Path(pam_sim.__file__).parent / folder)
    further = filter(None, os.environ.get(variable, '').split(os.pathsep))
    return _files_with(f'\n{mark} = ', own, *further)


def nodes() -> list[str]:
    """Return the names of the nodes, each a module with a main function."""
    from pathlib import Path
    return _files_with('\ndef main(', str(Path(__file__).resolve().parent.parent / 'nodes'))


def _files_with(text: str, *folders: str) -> list[str]:
    """Return the names of the Python files in folders that hold a text, sorted."""
    from pathlib import Path
    return sorted({path.stem for folder in folders for path in Path(folder).glob('*.py')
                   if text in path.read_text(encoding='utf-8')})


OF_RIG: dict[str, Names] = {
    'muscle': lambda: presets(MUSCLE), 'load': lambda: declared(*LOAD),
    'regulator': lambda: presets(REGULATOR)}


def _with_files(names: Names) -> Callable[..., list[str]]:
    """Return what argcomplete asks: names that fit, and files, which may stand for them."""
    def completer(prefix: str, **_: Any) -> list[str]:
        from argcomplete.completers import FilesCompleter
        return [name for name in names() if name.startswith(prefix)] + list(
            FilesCompleter()(prefix))
    return completer
