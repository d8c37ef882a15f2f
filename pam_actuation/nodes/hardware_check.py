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
What a file of parameters says to nobody, or against what is stated elsewhere.

A node only warns of a parameter that it does not know, and ROS is silent on a node that does not
run. With a wrong name a pressure limit would not be the one that is stated.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence

from pam_actuation.hardware.files import (
    BACK_END, entries, holds_parameters, matches, PARAMETERS, WILDCARDS)
from pam_actuation.namespaces import node_name_of
from pam_actuation.rigging.node_spec import NodeSpec, ORDER
from pam_actuation.rigging.plan import DRIVER, WATCHDOG
from pam_actuation.ros_missing import ros_missing
from pam_sim.errors import did_you_mean, InputError
from pam_sim.located_yaml import load_yaml, Located

SIMULATED_TIME = 'use_sim_time'
OF_ROS = (SIMULATED_TIME, 'qos_overrides.')
BRINGING_UP = ('autostart', 'notes_folder')     # set by what starts the nodes
OF_A_MUSCLE = DRIVER, WATCHDOG                  # one in the namespace of each muscle
SENSORS, IIO_ADC = 'hardware_sensors', 'iio_adc'
# One supply may feed several muscles.
OF_ONE_MUSCLE, OF_JOINT = ('pressure', 'contraction', 'force'), ('angle',)


def check_hardware(nodes: Iterable[NodeSpec]) -> None:
    """
    Check the parameter files of nodes before any of them starts.

    Raises
    ------
    InputError
        A file names a node or a parameter that there is not, a value that is not allowed or not
        what the nodes are started with, or no back end of a driver.

    """
    told: dict[str, list[NodeSpec]] = {}
    for node in nodes:
        if node.parameter_file:
            told.setdefault(node.parameter_file, []).append(node)
    for file, readers in told.items():
        _check_file(load_yaml(file), readers)


def check_users_file(file: str, nodes: Iterable[NodeSpec],
                     more: Mapping[str, object] | None = None, alone: bool = True) -> list[str]:
    """
    Check a file with parameters for any of the nodes, before one of them starts.

    Returns a sentence for each entry that names one of these nodes in another namespace: that of
    another rig, or a misspelt one.

    It may hold those of other nodes too, of a larger stack. ``more``: what every node that has
    such a parameter is started with besides those of its own. Not ``alone``: the file may be for
    other nodes only, which are checked elsewhere.

    Raises
    ------
    InputError
        No such file, or one of another kind. It names a parameter that there is not, or a value
        that is not allowed or not what the nodes are started with, or their file of hardware
        states another one. It reaches no node, misses a driver of the rig, or gives some of the
        nodes another clock.

    """
    tree = load_yaml(file)
    if not holds_parameters(tree):
        raise tree.error(f'is no parameter file: one holds parameters below `{PARAMETERS}` of a '
                         'node, such as `/**/valve_driver`')
    named = {node_name_of(node.name, node.namespace): node for node in nodes}
    kinds = sorted({node.name for node in named.values()})
    trees = {path: load_yaml(path) for path in {node.parameter_file for node in named.values()}
             if path}
    hardware = {name: _stated(name, trees[node.parameter_file]) for name, node in named.items()
                if node.parameter_file}
    none, elsewhere = True, []
    for words, holder, key in entries(tree):
        reached = {name: node for name, node in named.items() if matches(words, name)}
        if reached:
            none, given = False, holder[key][PARAMETERS]
            _check_names(given, sorted({node.name for node in reached.values()}))
            _check_values(given, reached, more or {}, hardware)
        elif words[-1] not in (*ORDER, *WILDCARDS) and (near := did_you_mean(words[-1], kinds)):
            raise holder.error(f'unknown node `{words[-1]}`{near}', key)
        elif words[-1] in kinds:
            elsewhere.append(f'{holder.where(key)}: `{key}` names none of the nodes that are '
                             'started, so what it states is not used here')
    timed = [name for name in named if True in _stated(name, tree).get(SIMULATED_TIME, ())]
    if timed and len(timed) < len(named) and not (more or {}).get(SIMULATED_TIME):
        others = ', '.join(name for name in named if name not in timed)
        raise tree.error(f'`{SIMULATED_TIME}` is true for {", ".join(timed)} and not for '
                         f'{others}; all nodes of a rig need one clock')
    if none and alone:
        raise tree.error(f'is for none of the nodes that are started: {", ".join(named)}')
    check_entries(tree, named)
    return elsewhere if alone else []


def check_stated_around(around: Sequence[tuple[str, object] | str], nodes: Iterable[NodeSpec],
                        users_file: str = '') -> None:
    """
    Check what the launch files around say of all nodes.

    ``around``: (name, value) of each SetParameter and the path of each SetParametersFromFile, the
    last of which counts. ``users_file``: of the argument ``params_file``, '' for none.

    Raises
    ------
    InputError
        That file, or the file of hardware of a node, states another value, which would count.

    """
    for node in nodes:
        full_name, stated = node_name_of(node.name, node.namespace), dict[str, object]()
        for one in around:
            if isinstance(one, tuple):
                stated.update([one])
            elif holds_parameters(tree := load_yaml(one)):
                stated |= {name: values[-1] for name, values in _stated(full_name, tree).items()}
        for file in filter(None, (node.parameter_file, users_file)):
            for name, values in _stated(full_name, load_yaml(file)).items():
                if name in stated and values[-1] != stated[name]:
                    raise InputError(
                        f'{stated[name]!r} of a launch file around is not what {file} states for '
                        f'{full_name}, {values[-1]!r}, which would count; state it in one of the '
                        'two', f'parameter {name}')


def _stated(full_name: str, tree: Located) -> dict[str, list[object]]:
    """Return what a file states of each parameter of a node."""
    stated: dict[str, list[object]] = {}
    for words, holder, key in entries(tree):
        if matches(words, full_name):
            for name, inside, last in _flat(holder[key][PARAMETERS]):
                stated.setdefault(name, []).append(inside[last])
    return stated


def _check_values(given: Located, reached: Mapping[str, NodeSpec], more: Mapping[str, object],
                  hardware: Mapping[str, Mapping[str, list[object]]]) -> None:
    """
    Raise InputError on the first value that is not allowed, or not the one that is given.

    ``hardware``: by the full name of a node, what another file states of its parameters.
    """
    from pam_actuation.nodes.interfaces import node_class
    from pam_actuation.nodes.parameters import COMMON_PARAMETERS, problem
    for name, holder, key in _flat(given):
        value = holder[key]
        if name in BRINGING_UP:
            raise holder.error(f'`{name}` is set by what starts the nodes', key)
        for full_name, node in reached.items():
            known = {one.name: one for one in (
                *COMMON_PARAMETERS, *node_class(node.name).PARAMETERS)}
            if name not in (*known, *more) or not isinstance(value, (bool, int, float, str)):
                continue
            wrong = ''
            if name in known:
                if type(value) is int and isinstance(known[name].default, float):
                    value = float(value)
                wrong = problem(known[name], value)
            own = {**more, **node.parameters}.get(name, value)
            if not wrong and own != value:
                wrong = (f'{value!r} is not what {full_name} is started with, {own!r}; choose it '
                         'with the option or argument that is there for it')
            others = [one for one in hardware.get(full_name, {}).get(name, ()) if one != value]
            if not wrong and others:
                wrong = (f'{value!r} is not what {node.parameter_file} states for {full_name}, '
                         f'{others[-1]!r}, which would count; state it in one of the two files')
            if wrong:
                raise holder.error(f'`{name}`: {wrong}', key)


def check_given_files(arguments: Sequence[str], kind: str, full_name: str) -> None:
    """
    Check the parameter files on the command line of a node by ``check_entries``.

    A file that is none, or none that is understood here, is left to ROS.
    """
    namespace = full_name.rpartition('/')[0]
    for before, file in zip(arguments, arguments[1:]):
        if before != '--params-file':
            continue
        try:
            tree = load_yaml(file)
        except InputError:
            continue
        if holds_parameters(tree):
            check_entries(tree, {full_name: NodeSpec(kind, namespace)})


def check_entries(tree: Located, named: Mapping[str, NodeSpec]) -> None:
    """
    Raise InputError where an entry misses the nodes it is for, or a later one overrules it.

    Parameters
    ----------
    tree : Located
        A parameter file.
    named : dict of str to NodeSpec
        The nodes that are started, by full name.

    """
    _check_reach(tree, named)
    _check_order(tree, named)


def _check_order(tree: Located, full_names: Iterable[str]) -> None:
    """Raise InputError where a wildcard overrules what is stated above for fewer nodes."""
    for full_name in full_names:
        stated: dict[str, tuple[int, object]] = {}      # how wide the entry is, and the value
        for words, holder, key in entries(tree):
            if not matches(words, full_name):
                continue
            width = 2 if '**' in words else 1 if '*' in words else 0
            for name, inside, last in _flat(holder[key][PARAMETERS]):
                before, value = stated.get(name), inside[last]
                if before is not None and before[0] < width and before[1] != value:
                    raise inside.error(
                        f'`{name}`: {value!r} would overrule {before[1]!r}, stated above for '
                        f'{full_name}: ROS takes the last entry that fits. Put entries with '
                        'wildcards first', last)
                stated[name] = width, value


def _check_reach(tree: Located, named: Mapping[str, NodeSpec]) -> None:
    """
    Raise InputError on an entry for a driver or watchdog that the rig has in another namespace.

    With a wildcard it may be for other rigs, where these nodes get the same parameters by other
    entries.
    """
    for kind in OF_A_MUSCLE:
        ours = sorted(name for name, node in named.items() if node.name == kind)
        told: set[str] = set()
        missed: list[tuple[tuple[str, ...], set[str], Located, str]] = []
        for words, holder, key in entries(tree):
            names = {name for name, _, _ in _flat(holder[key][PARAMETERS])}
            if any(matches(words, name) for name in ours):
                told |= names
            elif ours and words[-1] == kind and _is_near(words[:-1], named.values()):
                missed.append((words, names, holder, key))
        for words, names, holder, key in missed:
            if names - told or not {*words} & {*WILDCARDS}:
                raise holder.error(
                    f'`/{"/".join(words)}` is none of the nodes that are started: '
                    f'{", ".join(ours)}; `/**/{kind}` means each of them', key)


def _is_near(words: tuple[str, ...], nodes: Iterable[NodeSpec]) -> bool:
    """Tell whether the words of a namespace are that of a node, or one above it."""
    places = {''}
    for node in nodes:
        place = node.namespace.rstrip('/')
        while place:
            places.add(place)
            place = place.rpartition('/')[0]
    return any(matches(words, place) for place in places)


def _check_file(tree: Located, readers: list[NodeSpec]) -> None:
    named = {node_name_of(node.name, node.namespace): node for node in readers}
    without = {full_name for full_name, node in named.items() if node.name == DRIVER}
    for words, holder, key in entries(tree):
        kind, given = words[-1], holder[key][PARAMETERS]
        if kind not in WILDCARDS and kind not in ORDER:
            started = sorted({node.name for node in readers})
            raise holder.error(
                f'unknown node `{kind}`{did_you_mean(kind, started)}; this file is for '
                f'{" and ".join(started)}', key)
        reached = {name: node for name, node in named.items() if matches(words, name)}
        kinds = sorted({node.name for node in reached.values()} or {kind} - {*WILDCARDS})
        _check_names(given, kinds)
        _check_values(given, reached, {}, {})
        if BACK_END in given:
            without -= reached.keys()
    if without:
        raise tree.error(f'`{BACK_END}` is missing for {" and ".join(sorted(without))}: nothing '
                         'would drive the valve')
    check_entries(tree, named)
    _check_channels(tree, named)


def _check_channels(tree: Located, named: Mapping[str, NodeSpec]) -> None:
    """Raise InputError where two nodes read one analog input: one would see the other's sensor."""
    seen: dict[tuple[object, ...], str] = {}
    for full_name, node in named.items():
        stated = {name: values[0] for name, values in _stated(full_name, tree).items()
                  if all(value == values[0] for value in values)}
        if node.name != SENSORS or stated.get(BACK_END, IIO_ADC) != IIO_ADC:
            continue
        of_joint = node.parameters.get('place') == 'joint'
        for sensor in OF_JOINT if of_joint else OF_ONE_MUSCLE:
            channel = stated.get(f'{sensor}.channel', -1)
            place = stated.get('sysfs_root'), stated.get('adc.device'), channel
            other = seen.setdefault(place, full_name) if channel != -1 else full_name
            if other != full_name:
                raise tree.error(f'{other} and {full_name} both read channel {channel} of '
                                 f'{place[1]}; give each muscle channels of its own')


def _check_names(given: Located, kinds: list[str]) -> None:
    """Raise InputError on the first parameter that none of some nodes has."""
    try:
        from pam_actuation.nodes.interfaces import node_class
        from pam_actuation.nodes.parameters import COMMON_PARAMETERS
    except ImportError as error:
        raise InputError(ros_missing(error.name or 'rclpy')) from None
    known = {one.name for kind in kinds
             for one in (*COMMON_PARAMETERS, *node_class(kind).PARAMETERS)}
    for name, holder, key in _flat(given):
        if kinds and name not in known and not name.startswith(OF_ROS):
            raise holder.error(f'unknown parameter `{name}` of {" and ".join(kinds)}'
                               f'{did_you_mean(name, known)}', key)


def _flat(given: Located, above: str = '') -> Iterator[tuple[str, Located, str]]:
    """Return the full name of each parameter, the mapping that holds it, and its key there."""
    for key, value in given.items():
        if isinstance(value, Located):
            yield from _flat(value, f'{above}{key}.')
        else:
            yield f'{above}{key}', given, key
