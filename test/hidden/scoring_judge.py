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

"""Hold one answer against the key of its case."""

from dataclasses import dataclass

# The same thing by two names: either answer is right.
SAME = {'dead_volume': 'V_dead', 'viscous_damping': 'damping_n_s_per_m'}
# Kinds written as in no library that it holds since: the effect, and the number fitted beside it.
NAMED_SINCE = {'swinging_regulator': ('regulator_overshoot', 'T_m')}
REMAINDER = 0.2               # from here on an answer states that something is unexplained
EDGES = {'step', 'random_steps', 'staircase'}


@dataclass
class Answer:
    """What a result (the data of ``gap.json``) claims."""

    verdict: str
    effects: tuple            # names, as claimed
    parameters: tuple         # numbers called wrong
    reported: tuple           # everything that the result says it may be
    unexplained: float
    subsystem: str
    place: str                # the subsystem of the first row of `where`
    raw: dict

    @property
    def claimed(self):
        """Return what is claimed without a doubt: effects and wrong numbers."""
        if self.verdict in ('effects', 'partial'):
            return self.effects + self.parameters
        return self.parameters if self.verdict == 'parameter' else ()

    @property
    def single(self):
        """Return the one thing that is claimed, '' if none or several are."""
        return self.claimed[0] if len(self.claimed) == 1 else ''

    @property
    def label(self):
        """Return a short label for the confusion matrix."""
        if self.verdict == 'ambiguous':
            return 'set'
        return ' + '.join(sorted(self.claimed)) if self.claimed else self.verdict


def read_answer(raw):
    """Return the Answer in the data of a ``gap.json``."""
    effects = tuple(e['name'] for e in raw.get('effects') or ())
    parameters = tuple(p['name'] for p in raw.get('parameters') or ())
    verdict = raw.get('verdict', 'crashed')
    claims = verdict in ('effects', 'parameter', 'partial', 'ambiguous')
    reported = dict.fromkeys(raw.get('ambiguity_set') or ())
    if claims:
        reported |= dict.fromkeys(parameters if verdict == 'parameter' else effects + parameters)
    places = raw.get('where') or ()
    subsystem = place = places[0]['subsystem'] if places else ''
    if effects and claims:
        subsystem = raw['effects'][0].get('subsystem', subsystem)
    return Answer(verdict, effects, parameters, tuple(reported) if claims else (),
                  raw.get('unexplained_fraction') or 0.0, subsystem, place, raw)


def same(name, truth):
    """Return whether a claimed name is the truth, or another name of it."""
    return name == truth or SAME.get(truth) == name or SAME.get(name) == truth


def truths(key):
    """Return every name that is true of a case: effects and wrong numbers."""
    return (*key['effects'], *key['wrong'])


def is_right(answer, key):
    """Return whether exactly the truth is claimed, without a doubt."""
    wanted = truths(key)
    return len(answer.claimed) == len(wanted) and all(
        any(same(c, t) for c in answer.claimed) for t in wanted)


def is_in_set(answer, key):
    """Return whether all that is true is in the reported set."""
    return bool(truths(key)) and all(
        any(same(r, t) for r in answer.reported) for t in truths(key))


def wrong_names(answer, key):
    """Return the names claimed that are not true; none where a remainder is stated."""
    if key['outside'] and answer.unexplained >= REMAINDER:
        return ()
    right = (*truths(key), *named_since(key))
    return tuple(c for c in answer.claimed if not any(same(c, t) for t in right))


def named_since(key):
    """Return the names under which the library holds what was in none when this was written."""
    return tuple(n for kind in key['outside'] for n in NAMED_SINCE.get(kind, ()))


def is_false_alarm(answer):
    """Return whether a record with nothing to find gave anything but ``no_gap``."""
    return answer.verdict != 'no_gap'


def abstains(answer, key):
    """Return whether nothing false is claimed, or what is claimed leaves a stated remainder."""
    if answer.verdict in ('unknown', 'ambiguous', 'refused'):
        return True
    if named_since(key) and answer.claimed and not wrong_names(answer, key):
        return True
    return bool(answer.claimed) and answer.unexplained >= REMAINDER


def family_of(name, families):
    """Return the family of a claimed name; a number of the model is its own family."""
    for effect, number in SAME.items():
        if name == number:
            name = effect
    return families.get(name, name)


def is_of_family(answer, family, families):
    """Return whether something is claimed, or left in a set, and all of it is of a family."""
    names = answer.claimed or answer.reported
    return len(answer.claimed) <= 1 and bool(names) and all(
        family_of(n, families) == family for n in names)


def suggests_rightly(answer, key):
    """Return whether the suggested experiment is one that can tell the rivals apart."""
    suggestion = answer.raw.get('next_experiment') or {}
    experiment = suggestion.get('experiment') or {}
    needs = set(experiment.get('needs') or ()) | set(suggestion.get('needs') or ())
    names = {s if isinstance(s, str) else next(iter(s)) for s in experiment.get('segments') or ()}
    if not names:
        return False
    if not key['with_force']:
        return 'force' in needs
    if key['protocol'] == 'slow_gait':
        return bool(names & EDGES) or 'chirp' in names or 'multisine' in names
    return span_pa(experiment) >= 60e3


def span_pa(experiment):
    """Return by how much the values named in an experiment of pressures differ [Pa]."""
    values = []
    for segment in experiment.get('segments') or ():
        keys = {} if isinstance(segment, str) else next(iter(segment.values())) or {}
        for name in ('to_pa', 'low_pa', 'high_pa', 'low_center_pa', 'high_center_pa'):
            if name in keys:
                values.append(keys[name])
        if 'center_pa' in keys:
            values += [keys['center_pa'] - keys['amplitude_pa'],
                       keys['center_pa'] + keys['amplitude_pa']]
    moving = [v for v in values if v > 200e3]         # a rest is no band
    return max(moving) - min(moving) if moving else 0.0


def quantities(answer, key):
    """Return (truth, value, interval) of every quantity of a right answer that has a truth."""
    found = []
    for effect in answer.raw.get('effects') or ():
        for name, true in key['equivalent'].get(effect['name'], {}).items():
            given = (effect.get('equivalent') or {}).get(name)
            if given and given.get('value') is not None:
                found.append((true, given['value'], given.get('ci95'), f'{effect["name"]}.{name}'))
    for parameter in answer.raw.get('parameters') or ():
        if parameter['name'] in key['wrong']:
            found.append((key['wrong'][parameter['name']], parameter['value'],
                          parameter.get('ci95'), parameter['name']))
    return found


def shrink_percent(answer):
    """
    Return (shrink of the gap in %, whether it grew) in the signal that missed most after refit.

    Noise removed, on the certify run; (None, False) where no signal missed anything.
    """
    best = None
    for signal in (answer.raw.get('signals') or {}).values():
        floor, refit, after = (signal.get(k) for k in ('noise_floor', 'rmse_refit', 'rmse_after'))
        if not floor or refit is None or after is None or refit <= floor:
            continue
        if best is None or refit / floor > best[0]:
            left = max(after**2 - floor**2, 0.0) / (refit**2 - floor**2)
            best = (refit / floor, 100.0 * (1.0 - left**0.5), after > 1.02 * refit)
    return (None, False) if best is None else best[1:]
