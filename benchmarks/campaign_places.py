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

"""Part `places` of `benchmarks/campaign.py`: all that takes a cluster, here and there."""

import contextlib
import json
import os
from pathlib import Path
import subprocess
import sys
import tempfile

from campaign_clusters import dask, emptied, ray_cluster
from campaign_kills import content, listed
from pam_actuation.workers import Workers
from pam_sim import load_rig
from pam_sim.rollout.batch import Record, simulate_batch

ROOT = Path(__file__).resolve().parent.parent
MODEL = 'dmsp_5_300_hanging_mass'
RECORDINGS = 4
RUNS = 100
# How long something took, how often it was simulated, and the random salt of sealed keys.
LEFT_OUT = ('wall_s', 'processor_s', 'runtime_s', 'simulations', 'seconds', 'salt')
SEALED = 'sealed.json'      # digests of keys with their salt


def show(args):
    """Run each on one local process and on a cluster; print; return the exit code."""
    kinds = {'Dask': dask, 'Ray': ray_cluster} if args.ray else {'Dask': dask}
    rows, right = [], True
    folder = (lambda args, name: args.work / name) if args.kept else emptied
    here = {name: what(args, folder(args, f'here_{name}'), None)
            for name, what in PLACES.items()}
    for kind, cluster in kinds.items():
        with cluster(2) as address:
            for name, what in PLACES.items():
                same = what(args, folder(args, f'{kind}_{name}'), address) == here[name]
                right &= same
                rows.append(f'| {name} | {WORDS[name]} | {kind} | {"yes" if same else "no"} |')
                print(rows[-1], file=sys.stderr, flush=True)
    print('Each ran on one process of this machine, and on a cluster of two workers. Compared are '
          'all files of a campaign, controller and rules of a tuning, and all bytes of '
          f'{RUNS} simulations. Of the examination and of the ablation all answers are compared, '
          'without times and the random salt of the keys.\n')
    print('| | what runs | engine | equal |\n|---|---|---|---|')
    print('\n'.join(rows))
    return int(not right)


def run(out, *words, address=None, done=(0,)):
    """Run a Python program with the option of a cluster, unless its folder is there."""
    if out.exists():
        return
    words = [sys.executable, *map(str, words), *(('--cluster', address) if address else ())]
    ended = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False, env={
        **os.environ, 'PYTHONPATH': f'{ROOT}:{ROOT / "benchmarks"}:{ROOT / "test/hidden"}'})
    if ended.returncode not in done or 'Traceback' in ended.stderr:
        raise SystemExit(f'{" ".join(words)}\n{ended.stderr[-2000:]}')


def campaign(args, out, address):
    """Return the digest of the files of a campaign with gap."""
    run(out, '-m', 'pam_actuation.cli.main', 'campaign', listed(args, RECORDINGS), '--model',
        MODEL, '--out', out, '--jobs', 1, address=address)
    return content(out)


def tune(args, out, address):
    """Return controller and rules of a tuning."""
    if not out.exists():
        with tempfile.TemporaryDirectory(dir=args.work) as folder:
            folder = Path(folder) / 'tune'
            folder.mkdir()
            run(out, '-m', 'pam_actuation.cli.main', 'tune', '--model', 'dmsp_5_300_realistic',
                '--rollouts', 240, '--out', folder / 'tuned.yaml', '--jobs', 1, address=address,
                done=(0, 1))
            folder.rename(out)
    return [(out / name).read_bytes() for name in ('tuned.yaml', 'tuned_rules.json')]


def batch(args, out, address):
    """Return the bytes of many simulations."""
    rig = load_rig(MODEL)
    rigs = [rig.with_(parameters={'mass_kg': 4.0 + 0.01 * k}) for k in range(RUNS)]
    record = Record([3.0] * 2000)
    with contextlib.ExitStack() as stack:
        workers = stack.enter_context(Workers(cluster=address)) if address else None
        found = simulate_batch(rigs, record, spread=workers.map if workers else None)
    return [one.outputs.tobytes() for one in found]


def examination(args, out, address):
    """Return the answers of a small blind examination."""
    run(out, 'benchmarks/hidden_effects.py', '--number', 4, '--seed', 7, '--work', out, '--jobs',
        1, '--seconds', 900, address=address, done=(0, 1))
    return answers(out)


def ablation(args, out, address):
    """Return the answers of a small ablation of criteria."""
    run(out, 'benchmarks/criteria_ablation.py', '--recorded', 2, '--number', 1, '--work', out,
        '--jobs', 1, address=address)
    return answers(out)


def answers(folder):
    """Return {name: content} of the JSON files of a folder, times and salt aside."""
    found = {str(path.relative_to(folder)): without_chance(
        json.loads(path.read_text(encoding='utf-8'))) for path in folder.rglob('*.json')
        if path.name != SEALED}
    if not found:
        raise SystemExit(f'{folder} has no answer')
    return found


def without_chance(data):
    """Return plain data without times and salt."""
    if isinstance(data, dict):
        return {key: without_chance(one) for key, one in data.items() if key not in LEFT_OUT}
    return [without_chance(one) for one in data] if isinstance(data, list) else data


PLACES = {'campaign': campaign, 'tune': tune, 'simulate_batch': batch,
          'examination': examination, 'ablation': ablation}
WORDS = {
    'campaign': f'`pam campaign`, gap of {RECORDINGS} recordings',
    'tune': '`pam tune`, 240 rollouts',
    'simulate_batch': f'`simulate_batch`, {RUNS} runs of 2 s',
    'examination': '`benchmarks/hidden_effects.py`, 4 cases',
    'ablation': '`benchmarks/criteria_ablation.py`, 1 case of 2'}
