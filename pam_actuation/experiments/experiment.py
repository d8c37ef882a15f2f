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

from collections.abc import Sequence
from pathlib import Path
from typing import Any, TYPE_CHECKING

from pam_actuation.experiments.chain import Chain, DOMAINS, FORCE, LONGEST_S, Segment, TRACKED
from pam_actuation.experiments.limits import check_rig, jump_remarks, reach_remarks
from pam_actuation.resources import find_config
from pam_sim.errors import InputError
from pam_sim.files import check_name
from pam_sim.keys import Key, names_of
from pam_sim.located_yaml import check_value, dump_yaml, load_yaml, Located, LocatedList

if TYPE_CHECKING:
    from pam_sim.joint.rig import JointRig
    from pam_sim.rig import Rig

NEEDS = ('pressure', 'contraction', 'force', 'supply_pressure')
KEYS = (
    Key('name', str, 'Name in bags and reports.', required=True),
    Key('description', str, 'A sentence for people.', ''),
    Key('domain', str, 'What the values are, and in which unit.', 'contraction',
        choices=tuple(DOMAINS)),
    Key('needs', list, 'Measured topics without which the experiment tells nothing: '
        + ', '.join(NEEDS) + '.', otherwise='none'),
    Key('stop_after_s', float, 'End before the last primitive does.', unit='s', lower=0.01,
        upper=LONGEST_S, otherwise='never'),
    Key('segments', list, 'Primitives one after the other, each from where the former ended.',
        required=True),
    Key('disturbance', list, 'Primitives of a force on the load, N, against contraction '
        'positive.', otherwise='none'),
)


class Experiment:
    """
    What is asked of the rig over time.

    Parameters
    ----------
    name, description : str
        Name used in bags, and a sentence for people.
    domain : str
        What the values are: wanted contraction [m], wanted force [N], wanted joint angle
        [rad], wanted pressure [Pa absolute], or the raw valve signal (``ppr_voltage`` [V],
        ``hsv_duty``); pressure and valve signal run without a controller, an angle is
        for a joint.
    segments : list of (name, arguments, where)
        The primitives in order, with the keys of the file and ``file:line``.
    where : str
        ``file:line`` for mistakes in the whole.
    disturbance : list of (name, arguments, where), optional
        Primitives of a force on the load [N], against contraction positive.
    needs : sequence of str, optional
        Measured topics without which the experiment tells nothing.
    stop_after_s : float, optional
        End before the last primitive does, to try a long experiment.

    Raises
    ------
    InputError
        Unknown domain, primitive or key; a value outside the domain's range.

    """

    def __init__(
            self, name: str, description: str, domain: str, segments: Sequence[Segment],
            where: str = '', disturbance: Sequence[Segment] = (), needs: Sequence[str] = (),
            stop_after_s: float | None = None) -> None:
        if domain not in DOMAINS:
            raise InputError(
                f'domain is "{domain}"; allowed: {", ".join(DOMAINS)}', where)
        if not segments:
            raise InputError('segments is empty; an experiment needs at least one', where)
        self.name, self.description, self.domain = name, description, domain
        self.needs = tuple(needs)
        self.chain = Chain(DOMAINS[domain], segments, stop_after_s)
        self.disturbance = Chain(FORCE, disturbance) if disturbance else None
        whole_s = self.chain.whole_s
        if self.disturbance and self.disturbance.duration_s > whole_s + 1e-9:
            raise InputError(
                f'disturbance lasts {self.disturbance.duration_s:g} s, the experiment only '
                f'{whole_s:g} s', disturbance[0][2])
        self.stop_after_s = stop_after_s
        self.duration_s = self.chain.duration_s

    def __repr__(self) -> str:
        """Return name, domain and length in one line."""
        return f'{type(self).__name__}({self.name!r}, {self.domain}, {self.duration_s:g} s)'

    def at(self, t_s: float) -> tuple[float, float]:
        """Return (value, rate) at t_s since the start; outside, the end values at rest."""
        return self.chain.at(t_s)

    def shuts_valve(self, t_s: float) -> bool:
        """Tell whether both valves of a pair are shut at t_s, whatever the value."""
        return self.chain.shuts_valve(t_s)

    def external_force_n(self, t_s: float) -> float:
        """Return the disturbance on the load [N], against contraction positive; 0 outside."""
        if self.disturbance is None or not 0.0 <= t_s < min(
                self.disturbance.duration_s, self.duration_s):
            return 0.0
        return self.disturbance.at(t_s)[0]

    def sends_valve_command(self, valve: str) -> bool:
        """Tell whether some part of it speaks to a valve of this type directly."""
        if self.asks_for_motion or self.domain == 'pressure':
            return valve == 'hsv' and any(s.SHUTS_VALVE for s in self.chain.segments)
        return True

    @property
    def asks_for_motion(self) -> bool:
        """Whether the values are a reference for a controller, of a muscle or of a joint."""
        return self.tracked or self.domain == 'joint_angle'

    @property
    def tracked(self) -> bool:
        """Whether a controller of one muscle tracks the values."""
        return self.domain in TRACKED

    @property
    def cycles(self) -> tuple[float, float, int] | None:
        """Return (start_s, period_s, count) of the first periodic primitive, or None."""
        return next(iter(self.periodic_parts), None)

    @property
    def periodic_parts(self) -> tuple[tuple[float, float, int], ...]:
        """Return (start_s, period_s, count) of every periodic primitive."""
        return self.chain.periodic_parts

    def check_reachable(self, rig: 'JointRig | Rig') -> None:
        """Raise InputError where the experiment asks for what the rig cannot do."""
        check_rig(self, rig)

    def remarks(self, valve: str, rig: 'JointRig | Rig | None' = None,
                controller: Any = None) -> tuple[str, ...]:
        """
        Return sentences a person should read before this experiment runs.

        Parameters
        ----------
        valve : str
            Valve of the rig.
        rig : pam_sim.rig.Rig, optional
            Then also what of the reference it cannot reach.
        controller : object, optional
            May keep the pressure lower than the driver does, or be made for the other valve.

        """
        said: tuple[str, ...] = ()
        if valve == 'ppr' and any(s.SHUTS_VALVE for s in self.chain.segments):
            said = (
                'decay: a pressure regulator has no shut state; it holds the last command and '
                'refills what leaks, so this recording shows nothing of a leak',)
        return (*said, *filter(None, [getattr(controller, 'other_valve', '')]),
                *jump_remarks(self), *reach_remarks(self, rig, controller))

    def to_dict(self) -> dict[str, Any]:
        """Return the experiment as plain data, as it stands in a file."""
        data: dict[str, Any] = {
            'name': self.name, 'description': self.description, 'domain': self.domain}
        if self.needs:
            data['needs'] = list(self.needs)
        if self.stop_after_s is not None:
            data['stop_after_s'] = self.stop_after_s
        data['segments'] = self.chain.plain()
        if self.disturbance:
            data['disturbance'] = self.disturbance.plain()
        return data

    def to_yaml(self) -> str:
        """Return YAML text from which ``load_experiment`` makes the same experiment."""
        return dump_yaml(self.to_dict())


def load_experiment(source: Path | str) -> Experiment:
    """
    Load an experiment by name (``config/experiments/NAME.yaml``), path or YAML text.

    Raises
    ------
    InputError
        No such experiment, or a mistake in the file, with file and line; a name that cannot be
        that of a file.

    """
    if '\n' not in str(source):
        source = find_config('experiments', source)
    data = load_yaml(source)
    data.check_keys(names_of(KEYS))
    nothing = LocatedList()
    read = {key.name: key.read(data) for key in KEYS}
    return Experiment(
        check_name(read['name'], '`name`', data.where('name')), read['description'],
        read['domain'], _segments(read['segments']), data.where('segments'),
        _segments(read['disturbance'] or nothing), _needs(read['needs'] or nothing),
        read['stop_after_s'])


def _needs(items: LocatedList) -> tuple[str, ...]:
    """Return the names of the topics an experiment needs."""
    return tuple(check_value(item, f'item {k + 1} of `needs`', items.where(k), str, choices=NEEDS)
                 for k, item in enumerate(items))


def _segments(items: LocatedList) -> list[Segment]:
    """Return (name, arguments, where) of every entry of a list of segments."""
    return [_segment(items, k) for k in range(len(items))]


def _segment(items: LocatedList, index: int) -> Segment:
    item, where = items[index], items.where(index)
    if isinstance(item, str):
        return item, {}, where
    if not isinstance(item, Located) or len(item) != 1:
        raise InputError('each segment is one "primitive: {keys}" entry', where)
    name, arguments = next(iter(item.items()))
    if arguments is not None and not isinstance(arguments, Located):
        raise InputError(f'{name} needs its keys as {{key: value}}, not {arguments!r}', where)
    return str(name), arguments.plain() if arguments else {}, where
