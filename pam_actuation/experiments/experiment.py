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

"""An experiment file: a domain and a chain of primitives, checked before it runs."""

import bisect

from pam_actuation.experiments.primitives import make_primitive, Sine, Triangle
from pam_actuation.resources import find_config
from pam_sim.errors import InputError
from pam_sim.located_yaml import dump_yaml, load_yaml, Located
from pam_sim.units import P_ATM_PA

# What a value means, its unit suffix in files, its rest value and its allowed range.
DOMAINS = {
    'contraction': ('m', 0.0, 0.0, 0.25),
    'pressure': ('pa', P_ATM_PA, P_ATM_PA, 1_300_000.0),
}
KEYS = ('name', 'description', 'domain', 'segments')


class Experiment:
    """
    What is asked of the rig over time.

    Parameters
    ----------
    name, description : str
        Name used in bags, and a sentence for people.
    domain : {'contraction', 'pressure'}
        Whether values are wanted contraction [m] or wanted pressure [Pa absolute];
        a pressure experiment runs without a controller.
    segments : list of (name, arguments, where)
        The primitives in order, with the keys of the file and ``file:line``.

    Raises
    ------
    InputError
        Unknown domain, primitive or key; a value outside the domain's range.

    """

    def __init__(self, name, description, domain, segments, where=''):
        if domain not in DOMAINS:
            raise InputError(
                f'domain is "{domain}"; allowed: {", ".join(DOMAINS)}', where)
        if not segments:
            raise InputError('segments is empty; an experiment needs at least one', where)
        self.name, self.description, self.domain = name, description, domain
        suffix, rest, self._lower, self._upper = DOMAINS[domain]
        self._raw = [(n, dict(a or {})) for n, a, _ in segments]
        self.segments, self._starts = [], []
        value, t = rest, 0.0
        for n, arguments, place in segments:
            primitive = make_primitive(n, arguments, value, rest, suffix, place)
            self._check_range(primitive, n, suffix, place)
            self.segments.append(primitive)
            self._starts.append(t)
            t += primitive.duration_s
            value = primitive.end
        self.duration_s = t

    def _check_range(self, primitive, name, suffix, where):
        for k in range(201):
            t = primitive.duration_s * k / 200
            value = primitive.at(t)[0]
            if not self._lower - 1e-9 <= value <= self._upper + 1e-9:
                raise InputError(
                    f'{name} reaches {value:.6g} {suffix} after {t:.3g} s; allowed for '
                    f'{self.domain} is {self._lower:g} to {self._upper:g} {suffix}', where)

    def at(self, t_s):
        """Return (value, rate) at t_s since the start; outside, the end values at rest."""
        if t_s < 0.0:
            return self.segments[0].at(0.0)[0], 0.0
        if t_s >= self.duration_s:
            return self.segments[-1].end, 0.0
        k = bisect.bisect_right(self._starts, t_s) - 1
        return self.segments[k].at(t_s - self._starts[k])

    @property
    def cycles(self):
        """Return (start_s, period_s, count) of the first periodic primitive, or None."""
        for start, segment in zip(self._starts, self.segments):
            if isinstance(segment, Sine):
                return start, 1.0 / segment.frequency_hz, int(segment.cycles)
            if isinstance(segment, Triangle):
                return start, segment.period_s, int(segment.cycles)
        return None

    def check_reachable(self, rig):
        """Raise InputError where the experiment asks for more than the rig's stroke."""
        if self.domain != 'contraction':
            return
        stroke = rig.muscle.stroke_m
        steps = max(int(self.duration_s / 0.01), 1)
        worst = max(self.at(k * 0.01)[0] for k in range(steps + 1))
        if worst > stroke:
            raise InputError(
                f'experiment "{self.name}" asks for {1e3 * worst:.1f} mm of contraction; '
                f'{rig.name} allows 0 to {1e3 * stroke:.1f} mm')

    def to_dict(self):
        """Return the experiment as plain data, as it stands in a file."""
        return {'name': self.name, 'description': self.description, 'domain': self.domain,
                'segments': [{n: a} for n, a in self._raw]}

    def to_yaml(self):
        """Return YAML text from which ``load_experiment`` makes the same experiment."""
        return dump_yaml(self.to_dict())


def load_experiment(source):
    """
    Load an experiment by name (``config/experiments/NAME.yaml``), path or YAML text.

    Raises
    ------
    InputError
        No such experiment, or a mistake in the file, with file and line.

    """
    if '\n' not in str(source):
        source = find_config('experiments', source)
    data = load_yaml(source)
    data.check_keys(KEYS)
    items = data.require('segments', list)
    segments = [_segment(items, k) for k in range(len(items))]
    return Experiment(
        data.require('name', str), data.get('description', str, ''),
        data.get('domain', str, 'contraction', choices=tuple(DOMAINS)), segments,
        data.where('segments'))


def _segment(items, index):
    """Return (name, arguments, where) of one entry of the list of segments."""
    item, where = items[index], items.where(index)
    if isinstance(item, str):
        return item, {}, where
    if not isinstance(item, Located) or len(item) != 1:
        raise InputError('each segment is one "primitive: {keys}" entry', where)
    name, arguments = next(iter(item.items()))
    if arguments is not None and not isinstance(arguments, Located):
        raise InputError(f'{name} needs its keys as {{key: value}}, not {arguments!r}', where)
    return str(name), arguments.plain() if arguments else {}, where
