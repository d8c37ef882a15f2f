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

"""Ways to spoil the bytes of a bag, its metadata.yaml and its named records, by chance."""

import struct

import yaml

HUGE = tuple(
    struct.pack('<Q', number)
    for number in (0, 1, 2**31 - 1, 2**31, 2**32 - 1, 2**40, 2**62, 2**63 - 1, 2**63, 2**64 - 1))
NUMBERS = tuple(struct.pack('<d', number) for number in (
    float('nan'), float('inf'), -float('inf'), 1e308, -1e308, 5e-324))
WORDS = (
    b'sensor_msgs/msg/JointState', b'sensor_msgs/msg/FluidPressure', b'ros2msg', b'cdr',
    b'geometry_msgs/msg/WrenchStamped', b'/muscle/pressure', b'/muscle/contraction', b'zstd',
    b'lz4', b'diagnostic_msgs/msg/DiagnosticArray', b'pam_experiment', b'published.', b'CREATE')
VALUES = (
    None, True, -1, 0, 2**63, 10**400, 1e308, float('nan'), '', 'mcap', 'sqlite3', 'zstd', 'file',
    'message', 'run_0.mcap', '../run_0.mcap', '/etc/passwd', '\x00', 'ä' * 10_000, [], {}, [[]],
    {'': None}, [1, 2], ['run_0.mcap'] * 3, {'nanoseconds': 'soon'}, 'a\nb\n')
TEXTS = (
    b'a: [', b'\xff\xfe\x00', b'', b'\x00' * 50, b'- ' * 5_000 + b'x\n', b'[' * 3_000,
    b'{' * 3_000, b'? ' * 3_000, b'rosbag2_bagfile_information: !!python/object:os.system x\n',
    b'rosbag2_bagfile_information: 2026-99-99\n', b'rosbag2_bagfile_information: *none\n',
    b'a: &a [x, x]\n' + b''.join(
        b'%c: &%c [%s]\n' % (98 + i, 98 + i, b', '.join([b'*%c' % (97 + i)] * 9))
        for i in range(12))
    + b'rosbag2_bagfile_information: {relative_file_paths: *m, message_count: *m, '
    b'custom_data: {x: *m}}\n')
RECORDED = ('received', 'written', 'lost', 'dropped', 'missed_at_start', 'sent_before')


def mutate_bytes(rng, data):
    """Return the bytes of a data file with one to four things wrong."""
    data = bytearray(data)
    for _ in range(rng.randint(1, 4)):
        rng.choice(_BYTE_WAYS)(rng, data)
    return bytes(data)


def _place(rng, data):
    return rng.randrange(len(data) + 1)


def _flip(rng, data):
    for _ in range(rng.choice((1, 1, 4, 40))):
        if data:
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)


def _truncate(rng, data):
    del data[_place(rng, data):]


def _cut_out(rng, data):
    begin = _place(rng, data)
    del data[begin:begin + rng.choice((1, 8, 100, 5_000))]


def _repeat(rng, data):
    begin = _place(rng, data)
    data[begin:begin] = data[begin:begin + rng.choice((1, 9, 100, 5_000))]


def _random_bytes(rng, data):
    begin = _place(rng, data)
    length = rng.choice((1, 4, 64, 1_000))
    data[begin:begin + length] = rng.randbytes(length)


def _number(rng, data):
    begin = _place(rng, data)
    data[begin:begin + 8] = rng.choice(HUGE + NUMBERS)


def _record_length(rng, data):
    """Spoil a number right behind a name, where lengths and counts stand."""
    word = rng.choice(WORDS)
    begin = data.find(word, _place(rng, data))
    if begin >= 4:
        begin += rng.choice((-4, len(word)))
        data[begin:begin + 4] = rng.choice(HUGE)[:4]


def _wrong_word(rng, data):
    """Put one word in the place of another, at times of another length."""
    before, after = rng.choice(WORDS), rng.choice(WORDS)
    begin = data.find(before, _place(rng, data))
    if begin >= 0:
        if rng.random() < 0.7:
            after = after.ljust(len(before), b'x')[:len(before)]
        data[begin:begin + len(before)] = after


_BYTE_WAYS = (_flip, _flip, _truncate, _cut_out, _repeat, _random_bytes, _number, _number,
              _record_length, _wrong_word)


def mutate_metadata(rng, data):
    """Return a metadata.yaml with another value, another text or spoiled bytes."""
    way = rng.random()
    if way < 0.15:
        return rng.choice(TEXTS)
    if way < 0.4:
        return mutate_bytes(rng, data)
    document = yaml.load(data, getattr(yaml, 'CSafeLoader', yaml.SafeLoader))
    for _ in range(rng.randint(1, 3)):
        _spoil_node(rng, document)
    return yaml.dump(document, allow_unicode=True).encode('utf-8', 'replace')


def _spoil_node(rng, node):
    """Replace, remove or add something at a random depth."""
    while True:
        keys = list(node) if isinstance(node, dict) else list(range(len(node)))
        if not keys:
            return
        key = rng.choice(keys)
        inner = node[key]
        if isinstance(inner, (dict, list)) and inner and rng.random() < 0.75:
            node = inner
            continue
        if rng.random() < 0.15:
            del node[key]
        else:
            node[key] = rng.choice(VALUES)
        return


def mutate_records(rng):
    """Return named records of a bag with contents that no recorder writes."""
    texts = ('', '0', '-5', '²', '9' * 5_000, '1e400', 'nan', 'a\nb', '\x1b[2J', '{', 'ä' * 9_999,
             'name: [', 'rig: 5', '[' * 2_000, 'ppr', 'hsv', 'pneumatic')
    experiment = {
        key: rng.choice(texts) for key in (
            'experiment_name', 'valve', 'seed', 'software_version', 'units', 'experiment', 'rig',
            'controller', rng.choice(texts))}
    recording = {
        f'/muscle/{topic}.{what}': rng.choice(texts)
        for topic in ('pressure', 'contraction', 'force') for what in RECORDED}
    return {'pam_experiment': experiment, 'pam_recording': recording}
