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
Wrong YAML files of every kind, made from the shipped ones, each the same in every run.

::

    python test/fuzz/yaml_mutations.py --count 10000

Every file must end as a loaded object or as an InputError that names file and line, in little
time and memory. The program prints how often each outcome came and exits with 1 otherwise.
"""

import argparse
from collections import Counter
from pathlib import Path
import random
import resource
import sys
import tempfile
import time
import traceback

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT)]    # as a program: the source tree as it stands

from pam_actuation.control.config import controller_from_tree, load_controller  # noqa: E402
from pam_actuation.experiments import load_experiment  # noqa: E402
from pam_sim import load_rig  # noqa: E402
from pam_sim.errors import InputError  # noqa: E402
from pam_sim.joint import load_joint  # noqa: E402
from pam_sim.located_yaml import load_yaml  # noqa: E402
from pam_sim.muscle.muscle import read_muscle  # noqa: E402

SLOWEST_S = 5.0
MOST_MEMORY_KB = 300_000      # that the process may grow by
RIG = 'dmsp_5_300_realistic'
JOINT = 'joint_dmsp_5_300'
BOMB = ('a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n' + ''.join(
    f'a{k}: &a{k} [{", ".join([f"*a{k - 1}"] * 10)}]\n' for k in range(1, 10)))
NASTY = (
    '1e400', '-1e308', '1e300', '1e15', '1e-320', '0', '-1', '999999999', '1' * 250, '9' * 400,
    '1' * 6000, '.nan', '.inf', '-.inf', 'true', 'null', '~', '', '[]', '{}', '[1, 2]', '{a: 1}',
    '[[1, 2], [3]]', '"text"', '""', '!!python/object:os.system x', '!!int x', '!!float x',
    '!!bool x', '!!timestamp x', '!!binary x', '!!set {a}', '!!null x', '2020-01-01', '0x1F',
    '0o17', '1_000', '"\\ud800"', '"\\0"', '*x', '&x [*x]', '|\n  block', '../../etc/passwd',
    '[' * 300, '{a: ' * 300, '- ' * 60, '%', '@', '\t', '": "', "'", '#', '? [a] : b', '<<: *x')
FULL_RIG = """\
name: everything
muscle:
  like: dmsp_5_300
  law: {name: tondu_lopez}
load: hanging_mass
valve: hsv
fidelity: averaged
parameters: {mass_kg: 6.0, C: 2.0e-9}
tolerance: {mass_kg: 0.01}
effects:
  - name: leakage
    parameters: {conductance_m3_per_s_pa: 2.0e-13}
    source: {note: a test}
  - name: coulomb_friction
    parameters: {force_n: 3.0}
sensors: {pressure_noise_pa: 300.0, stamp_jitter_s: 0.0002}
"""


def sources():
    """Return (name, text, function that loads a path) of every file to start from."""
    rig = load_rig(RIG)
    joint = load_joint(JOINT)

    def controller(path):
        return controller_from_tree(load_yaml(path), rig, str(path.parent))

    def joint_controller(path):
        return controller_from_tree(load_yaml(path), joint, str(path.parent))

    def muscle(path):
        return read_muscle(load_yaml(path))

    found = [('everything', FULL_RIG, load_rig),
             ('recorded', load_controller('sofc_hsv', rig).to_yaml(), controller)]
    for folder, load in ((ROOT / 'pam_sim' / 'presets', load_rig),
                         (ROOT / 'pam_sim' / 'joint' / 'presets', load_joint),
                         (ROOT / 'pam_sim' / 'muscle' / 'sizes', muscle),
                         (ROOT / 'config' / 'controllers', controller),
                         (ROOT / 'config' / 'experiments', load_experiment)):
        for path in sorted(folder.glob('*.yaml')):
            text = path.read_text(encoding='utf-8')
            turns_joint = load is controller and 'mode: joint' in text
            found.append((path.stem, text, joint_controller if turns_joint else load))
    return found


def _flip(text, rng):
    raw = bytearray(text.encode())
    for _ in range(rng.randint(1, 4)):
        raw[rng.randrange(len(raw))] = rng.randrange(256)
    return bytes(raw)


def _truncate(text, rng):
    return text.encode()[:rng.randrange(len(text))]


def _garbage(text, rng):
    raw, at = text.encode(), rng.randrange(len(text))
    return raw[:at] + rng.randbytes(rng.randint(1, 40)) + raw[at:]


def _value(text, rng):
    lines = text.splitlines()
    at = rng.choice([k for k, line in enumerate(lines) if ':' in line])
    key, _, _ = lines[at].partition(':')
    lines[at] = f'{key}: {rng.choice(NASTY)}'
    return lines


def _inner_value(text, rng):
    """Replace one value inside a flow mapping, or else append to a line."""
    lines = text.splitlines()
    at = rng.randrange(len(lines))
    parts = lines[at].split(',')
    k = rng.randrange(len(parts))
    key, colon, rest = parts[k].rpartition(':')
    closing = '}' if rest.rstrip().endswith('}') else ''
    parts[k] = f'{key}{colon} {rng.choice(NASTY)}{closing}'
    lines[at] = ','.join(parts)
    return lines


def _lines(text, rng):
    """Double, remove, exchange, indent or misspell a line."""
    lines = text.splitlines()
    at, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    how = rng.randrange(5)
    if how == 0:
        lines.insert(other, lines[at])
    elif how == 1:
        del lines[at]
    elif how == 2:
        lines[at], lines[other] = lines[other], lines[at]
    elif how == 3:
        lines[at] = ' ' * rng.randint(1, 4) + lines[at]
    else:
        lines[at] = lines[at].replace(rng.choice('abcdeimnorst'), rng.choice('xyz_9'), 1)
    return lines


def _bomb(text, rng):
    lines = BOMB.splitlines() + text.splitlines()
    at = rng.choice([k for k in range(10, len(lines)) if ':' in lines[k]])
    lines[at] = lines[at].partition(':')[0] + ': *a9'
    return lines


# All bombs end in the same place, after a tenth of a second: fewer of them.
MUTATIONS = 5 * (_flip, _truncate, _garbage, _value, _value, _inner_value, _lines) + (_bomb,)


def mutated(number, found):
    """Return (name, bytes, load) of the wrong file of a number."""
    rng = random.Random(number)
    name, text, load = found[number % len(found)]
    mutation = rng.choice(MUTATIONS)
    made = mutation(text, rng)
    if isinstance(made, list):
        made = '\n'.join(made).encode('utf-8', 'surrogatepass') + b'\n'
    return f'{number} ({name}, {mutation.__name__[1:]})', made, load


def outcome(path, load):
    """Load a file; return 'loaded', 'refused', or a sentence on what should not be."""
    started = time.process_time()      # of the processor: others may be busy as well
    try:
        load(path)
        result = 'loaded'
    except InputError as error:
        place = str(error.where)
        named = place.startswith(str(path)) and place[len(str(path)):].startswith(':')
        result = 'refused' if named else f'refused without file and line: {error}'[:300]
    except Exception:
        result = 'traceback: ' + traceback.format_exc().strip()[-600:]
    seconds = time.process_time() - started
    return f'took {seconds:.1f} s' if seconds > SLOWEST_S else result


def run(count, first=0, progress=None):
    """
    Load ``count`` wrong files.

    Returns
    -------
    outcomes : Counter
        How often each came.
    bad : list of str
        A sentence on each that is neither loaded nor refused with file and line.

    """
    found, outcomes, bad = sources(), Counter(), []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'wrong.yaml'
        for _, text, load in found:     # right so far; what a first load takes is not the file's
            path.write_text(text, encoding='utf-8')
            load(path)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        for number in range(first, first + count):
            name, raw, load = mutated(number, found)
            path.write_bytes(raw)
            result = outcome(path, load)
            outcomes[result.partition(':')[0]] += 1
            if result not in ('loaded', 'refused'):
                bad.append(f'{name}: {result}')
            if progress and number % 500 == 0:
                progress(number)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    if grown > MOST_MEMORY_KB:
        bad.append(f'memory grew by {grown // 1000} MB')
    return outcomes, bad


def main():
    """Run the program; return 1 where an outcome should not be."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('--count', type=int, default=500)
    parser.add_argument('--first', type=int, default=0, help='number of the first file')
    args = parser.parse_args()
    started = time.perf_counter()
    outcomes, bad = run(args.count, args.first, lambda n: print(f'{n} ...', file=sys.stderr))
    for sentence in bad[:20]:
        print(sentence)
    print(f'{args.count} files in {time.perf_counter() - started:.0f} s: '
          + ', '.join(f'{count} {name}' for name, count in outcomes.most_common()))
    return 1 if bad else 0


if __name__ == '__main__':
    sys.exit(main())
