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

"""What ``pam`` alone shows: the first steps, and every verb with one line."""

import textwrap

FIRST_STEPS = (
    ('pam simulate sine_quarter_hz --out runs/first', 'record a simulated run'),
    ('pam info runs/first', 'see what is in the recording'),
    ('pam report runs/first', 'see it as a page with plots'),
    ('pam experiments', 'see what else can be run'),
    ('pam VERB --help', 'see all options of a verb, with an example'))
GROUPS = {
    'Make a recording': {
        'simulate': 'simulate an experiment without ROS, faster than real time',
        'run': 'run an experiment on live nodes and record it',
        'up': 'bring up the nodes of a rig, a joint or both knees',
        'import': 'make a bag of a table measured elsewhere: CSV, Excel, LabVIEW, MAT',
        'rig': 'write a commented file of a rig, known and unknown numbers, or check one',
        'demo': 'see everything once with live nodes, in two and a half minutes'},
    'Operate running nodes': {
        'status': 'how each node is, and why',
        'estop': 'emergency stop: every driver vents until it is reset',
        'reset': 'end a latched stop of the drivers',
        'param': 'list, read or set parameters'},
    'Look at a recording': {
        'info': 'topics, rates, losses and plausibility',
        'view': 'a live page of a running rig in the browser, or a recording with a slider',
        'report': 'one HTML page with plots and metrics',
        'replay': 'step controller, driver and plant again on what was recorded',
        'rules': 'what the rules of a controller say, and what learning changed',
        'export': 'write a bag as a table: CSV, Excel, MAT, Parquet'},
    'Make a controller or a model better': {
        'tune': 'tune a controller on a model',
        'identify': 'determine the unknown numbers of a rig',
        'gap': 'find what a model misses, name it and add it',
        'investigate': 'record and compare in rounds, until the gap has one answer',
        'campaign': 'many recordings: what changed on which rig since which day',
        'characterise': 'make static surfaces from runs under fixed loads',
        'valves': 'compare the valve types on one rig'},
    'See what there is': {
        'experiments': 'experiments, rigs and controllers by name',
        'models': 'muscle laws, valves, loads, effects and rigs with their equations',
        'nodes': 'nodes with their parameters, topics and services'}}
VERBS = tuple(verb for group in GROUPS.values() for verb in group)


def overview() -> str:
    """Return the text that ``pam`` prints without arguments."""
    wide = max(len(command) for command, _ in FIRST_STEPS) + 2
    lines = ['Simulate, run, record, replay and tune a pneumatic muscle rig.', 'First steps']
    lines += [*(f'  {command:{wide}}{text}' for command, text in FIRST_STEPS), '']
    for title, verbs in GROUPS.items():
        lines += [title, *(f'  {verb:14}{text}' for verb, text in verbs.items())]
    return '\n'.join(lines)


def one_line(verb: str) -> str:
    """Return the line of a verb."""
    return next(verbs[verb] for verbs in GROUPS.values() if verb in verbs)


def wrapped(names: list[str]) -> str:
    """Return names as lines of a paragraph, set in by two columns."""
    return textwrap.fill(', '.join(names), 95, initial_indent='  ', subsequent_indent='  ')
