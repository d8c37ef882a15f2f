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
Measure how fast bags load, beside the reader of rosbags, and what an hour costs.

Run ``python benchmarks/loading.py``; it prints the tables of docs/results/loading.md. Both
readers read the same bags in turn in the same run; the best of several runs
counts. What they return is compared number by number. The bags are made in a
temporary folder (about 0.6 GB for the hour) and removed.
"""

import argparse
import json
from pathlib import Path
import subprocess
import sys
import tempfile
import time

from long_bag import TOPICS, write_long_bag
import numpy as np
from pam_actuation.bags.load import load_run, read_series
from pam_actuation.bags.oddities import Oddities
from pam_actuation.bags.source import read_bag
from pam_actuation.topics import definitions
import results_page
from rosbags.highlevel import AnyReader

STREAMS = {
    'FluidPressure': ('pressure',),
    'JointState': ('contraction',),
    'WrenchStamped': ('force',),
    'the three together': ('pressure', 'contraction', 'force'),
}
# Where the value of a series stands in the message.
FIELDS = {
    ('pressure', 'pressure_pa'): lambda message: message.fluid_pressure,
    ('pressure_command', 'pressure_pa'): lambda message: message.fluid_pressure,
    ('contraction', 'contraction_m'): lambda message: message.position[0],
    ('contraction', 'velocity_m_per_s'): lambda message: message.velocity[0],
    ('force', 'force_n'): lambda message: message.wrench.force.x,
    ('valve_signal', 'ppr_voltage'): lambda message: message.effort[0],
}
HOUR = '\n'.join((
    'import json, resource, sys, time',
    'from pam_actuation.bags.load import load_run',
    'start = time.perf_counter()',
    'run = load_run(sys.argv[1])',
    'seconds = time.perf_counter() - start',
    'peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024',
    'counts = {name: len(one) for name, one in run.topics.items()}',
    'print(json.dumps([seconds, time.process_time(), peak, counts, [*run.remarks, *run.notes]]))'))


def load_here(path):
    """Return short name to Series of all topics, whatever they are."""
    bag = read_bag(path)
    odd = Oddities()
    series = {
        name.rsplit('/', 1)[-1]: read_series(name.rsplit('/', 1)[-1], topic, odd)
        for name, topic in bag.topics.items()}
    if odd != Oddities():
        raise SystemExit(f'the bag is odd: {odd}')
    return series


def load_with_rosbags(path):
    """Return short name to messages, read and deserialised by rosbags."""
    found = {}
    with AnyReader([path], default_typestore=definitions.typestore()) as reader:
        for connection, _, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            found.setdefault(connection.topic.rsplit('/', 1)[-1], []).append(message)
    return found


def assert_equal(ours, theirs):
    """Stop unless both readers returned the same stamps and values."""
    if set(ours) != set(theirs):
        raise SystemExit(f'topics differ: {sorted(ours)} and {sorted(theirs)}')
    for short, one in ours.items():
        stamps = [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in theirs[short]]
        np.testing.assert_array_equal(one.stamp_ns, stamps)
        for name, column in one.values.items():
            np.testing.assert_array_equal(
                column, [FIELDS[short, name](message) for message in theirs[short]])


def timed(call, path):
    """Return (seconds, result) of one call."""
    start = time.perf_counter()
    result = call(path)
    return time.perf_counter() - start, result


def print_streams(folder, seconds, repeats):
    """Print messages per second of both readers, per type of message."""
    print('| 1 kHz streams | messages | load_run, messages/s | rosbags AnyReader, messages/s | '
          'times faster |')
    print('|---|---|---|---|---|')
    for label, topics in STREAMS.items():
        path = write_long_bag(folder / f'{label}.mcap', topics, seconds)
        here = load_run if len(topics) > 1 else load_here
        ours_s, theirs_s = [], []
        here(path)
        for _ in range(repeats):               # in turn, so that both meet the same machine
            seconds_here, ours = timed(here, path)
            seconds_there, theirs = timed(load_with_rosbags, path)
            ours_s.append(seconds_here)
            theirs_s.append(seconds_there)
        assert_equal(getattr(ours, 'topics', ours), theirs)
        count = sum(map(len, theirs.values()))
        print(f'| {label} | {count:,} | {count / min(ours_s):,.0f} | '
              f'{count / min(theirs_s):,.0f} | {min(theirs_s) / min(ours_s):.0f} |', flush=True)


def print_hour(folder, minutes):
    """Print time and memory of loading five topics of 1 kHz in a fresh process."""
    path = write_long_bag(folder / 'hour.mcap', TOPICS, 60 * minutes)
    done = subprocess.run(
        [sys.executable, '-c', HOUR, str(path)], check=True, capture_output=True, text=True)
    seconds, cpu_s, peak, counts, remarks = json.loads(done.stdout)
    if set(counts.values()) != {60_000 * minutes} or remarks:
        raise SystemExit(f'not what was written: {counts} {remarks}')
    count = sum(counts.values())
    print('| five topics at 1 kHz | messages | file | by the clock | time of one core '
          '| messages/s | peak memory |\n|---|---|---|---|---|---|---|')
    print(f'| {minutes} minutes | {count:,} | {path.stat().st_size / 1e9:.2f} GB '
          f'| {seconds:.1f} s | {cpu_s:.1f} s | {count / seconds:,.0f} '
          f'| {peak / 2**30:.2f} GiB |')


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--seconds', type=int, default=60, help='length of the streams')
    parser.add_argument('--minutes', type=int, default=60, help='length of the long bag')
    parser.add_argument('--repeats', type=int, default=3)
    results_page.add_write(parser, 'loading')
    return parser


def main():
    """Print both tables."""
    args = command_line().parse_args()
    print(f'{results_page.machine()}\n')
    with tempfile.TemporaryDirectory() as folder, results_page.printed(args, __file__):
        print_streams(Path(folder), args.seconds, args.repeats)
        print()
        print_hour(Path(folder), args.minutes)


if __name__ == '__main__':
    main()
