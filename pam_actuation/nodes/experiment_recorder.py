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

"""The recorder on ROS: every message of the rig, as it came, into a bag."""

from collections.abc import Sequence
import contextlib
import json
import os
import sys
import time

from pam_actuation.bags.ending import ENDED_FILE
from pam_actuation.bags.ending import Ending
from pam_actuation.bags.ending import ending_of
from pam_actuation.bags.ending import EndWatch
from pam_actuation.bags.ending import ERROR as RUN_FAILED
from pam_actuation.bags.ending import RECORDED_FILE
from pam_actuation.bags.metadata import (
    experiment_metadata, names_text, own_name, TOPIC_NAMES)
from pam_actuation.bags.recorder import RecorderCore, RecordingSummary
from pam_actuation.bags.writer import BagWriter, check_limits
from pam_actuation.drivers.parameter import node_parameter
from pam_actuation.nodes.diagnostics import ERROR, Values
from pam_actuation.nodes.diagnostics import OK
from pam_actuation.nodes.endpoints import PolledSubscription, Taken
from pam_actuation.nodes.managed import ManagedNode
from pam_actuation.nodes.physics_node import MAX_SEED
from pam_actuation.nodes.qos import is_latched
from pam_actuation.nodes.ros_messages import message_class
from pam_actuation.nodes.runner import run
from pam_actuation.topics.codec import decode
from pam_actuation.topics.definitions import schema_text, type_hash
from pam_actuation.topics.quality import LATCHED, OF_LATCHED, Quality, USUAL
from pam_actuation.topics.table import DIAGNOSTICS, RECORDED, RECORDED_OF_JOINT, ROOT, Topic
from pam_sim.errors import InputError
from pam_sim.files import write_text

KNOWN: dict[str, Topic] = {**RECORDED, **RECORDED_OF_JOINT}
UNKNOWN_VALVE, UNKNOWN_SEED = 'unknown', -1
TAKE_PERIOD_S = 0.02        # messages carry their own times, so taking may be leisurely
CHECK_EVERY = 10            # ticks between two looks at the counts
QUIET_S = 0.15              # nothing for this long: all that was sent has arrived
READY_TIMEOUT_S = 5.0
FAREWELL_S = 2.0            # stopped together with the others: wait for their last messages


class ExperimentRecorder(ManagedNode):
    """
    Record while active; each activation writes one bag.

    Its namespace is that of a muscle, or that of a joint: it then records the joint and both
    muscles below it.

    It stores serialized messages with the times of sending and receiving. The sequence numbers
    of their publishers show losses. A write error ends the node with exit code 1; what was
    written is kept. After a signal, the node continues until the other nodes are gone, at most
    2 s.
    """

    NAME = 'experiment_recorder'
    SPEAKS_AT_ONCE = False      # what it says before it records would be missing in the bag
    STUCK_AFTER_S = 30.0        # the disk may be slow
    LIVE = ('output',)
    FOLLOWS_CLOCK = False       # it takes what arrives, also while the simulated time stands
    PARAMETERS = (
        node_parameter(
            'output', 'bags/experiment', 'Folder of the bag; must not exist. A change counts at '
            'the next activation.'),
        node_parameter(
            'overwrite', False, 'Replace the bag that is there, once the new one is whole.'),
        node_parameter(
            'topics', [''], 'Topics to record, relative to the namespace (diagnostics is '
            '/diagnostics). Empty: all of a muscle; where rig is a joint, all of the joint and '
            'of both muscles.'),
        node_parameter(
            'extra_topics', [''], 'Further topics, each as NAME=TYPE, for instance '
            '/bench/imu=sensor_msgs/msg/Imu.'),
        node_parameter(
            'max_bagfile_size_bytes', 0, 'Go on in the next file from about this size on '
            '[bytes]; 0: never.', 0, 2**53),
        node_parameter(
            'max_bagfile_duration_s', 0.0, 'Go on in the next file after this time [s]; 0: '
            'never.', 0.0, 1e9),
        node_parameter(
            'await_topics', [''], 'Activation waits for the publishers of these topics.'),
        node_parameter(
            'metadata_file', '', 'JSON file of texts for the record pam_experiment. Empty: '
            'made from the parameters below.'),
        node_parameter(
            'notes_folder', '', 'Folder in which whoever started this node may say why the run '
            'ended (ended.json) and in which the node says what it recorded (recorded.json). '
            'Empty: none.'),
        node_parameter('experiment', '', 'Experiment that is played: name or path.'),
        node_parameter('rig', '', 'Rig or joint: preset, or path of its file.'),
        node_parameter('controller', '', 'Controller preset, or path of its file.'),
        node_parameter(
            'valve_type', UNKNOWN_VALVE, 'Valve of the rig; unknown: that of the rig, else the '
            'bag does not say it.', choices=('ppr', 'hsv', UNKNOWN_VALVE)),
        node_parameter(
            'seed', UNKNOWN_SEED, 'Seed of the simulated sensors; -1: none, the bag does not '
            'say one.', UNKNOWN_SEED, MAX_SEED),
    )

    core: RecorderCore | None = None
    _recorded = False           # in this process

    @property
    def _core(self) -> RecorderCore:
        """Return what records while the node is active."""
        assert self.core is not None
        return self.core

    def check(self) -> None:
        """Refuse topics that are not known."""
        for name in ('topics', 'await_topics'):
            for topic in self.value(name):
                if topic and topic not in KNOWN:
                    raise InputError(
                        f'{topic!r} is not a topic of the rig; known are '
                        f'{", ".join(KNOWN)}', f'parameter {name}')
        check_limits(
            self.value('max_bagfile_size_bytes'), self.value('max_bagfile_duration_s'))
        self.extra = dict(parse_extra_topic(text) for text in self.value('extra_topics') if text)

    def setup(self) -> None:
        """Read the metadata, subscribe."""
        self.topics: tuple[str, ...] = tuple(RECORDED)      # unless told otherwise
        self.metadata = {**self._metadata(),
                         **own_name(self.value('muscle'), self.get_namespace())}
        self.sources: dict[str, PolledSubscription] = {}
        self.types: dict[str, str] = {}
        self.latched: set[str] = set()      # of the further topics
        recorded = list(filter(None, self.value('topics'))) or self.topics
        for topic in filter(None, self.value('await_topics')):
            if topic not in recorded:
                raise InputError(f'{topic!r} is not recorded, so it cannot be awaited; recorded '
                                 f'are {", ".join(recorded)}', 'parameter await_topics')
        for topic in recorded:
            row = KNOWN[topic]
            name = row.full_name('') if row.place == ROOT else topic
            self._record(topic, name, row.type_name, row.service.recorder)
        names = {name: source.topic for topic, source in self.sources.items() if (
            name := KNOWN[topic].full_name('') if KNOWN[topic].place == ROOT
            else f'{self.get_namespace().rstrip("/")}/{topic}') != source.topic}
        if names:
            self.metadata[TOPIC_NAMES] = names_text(names)
        for name, type_name in self.extra.items():
            full_name = self.resolve_topic_name(name)
            if any(source.topic == full_name for source in self.sources.values()):
                raise InputError(f'{name!r} is {full_name}, which is recorded anyway; leave it '
                                 'out', 'parameter extra_topics')
            self._record(name, name, type_name, USUAL.recorder)

    def _record(self, topic: str, name: str, type_name: str, quality: Quality) -> None:
        """Subscribe to a topic; definitions are looked up now, not at the first message."""
        schema_text(type_name)
        type_hash(type_name)
        self.types[topic] = type_name
        self.sources[topic] = self.subscribe(message_class(type_name), name, quality)

    def _record_latched(self, name: str) -> None:
        """Subscribe anew to a further topic, so that its last message comes once more."""
        former = self.sources[name]
        self.subscriptions_polled.remove(former)
        former.destroy()
        self.latched.add(name)
        self._record(name, name, self.types[name], OF_LATCHED)

    def _look_for_latched(self) -> None:
        """Find further topics whose last message was sent before this node came."""
        for name in self.extra.keys() - self.latched:
            topic = self.sources[name].topic
            if topic not in self.known and is_latched(self, topic):
                self._record_latched(name)

    def _metadata(self) -> dict[str, str]:
        path = self.value('metadata_file')
        if path:
            try:
                with open(path, encoding='utf-8') as stream:
                    texts = json.load(stream)
            except (OSError, ValueError) as error:
                raise InputError(f'cannot be read: {error}', path) from None
            if not isinstance(texts, dict):
                raise InputError('is no JSON object, {"NAME": "TEXT"}', path)
            return texts
        from pam_actuation.drivers.recorded import driver_facts
        valve, seed = self.value('valve_type'), self.value('seed')
        valve = '' if valve == UNKNOWN_VALVE else valve
        experiment = rig = controller = None
        if self.value('experiment'):
            from pam_actuation.experiments import load_experiment
            experiment = load_experiment(self.value('experiment'))
        if self.value('rig'):
            from pam_sim.joint import JointRig, load_rig_or_joint
            rig = load_rig_or_joint(self.value('rig'), valve or None)
            if isinstance(rig, JointRig):
                self.topics = tuple(RECORDED_OF_JOINT)
        if self.value('controller'):
            from pam_actuation.control.config import load_controller
            # A recorder refuses none: it says which one ran.
            controller = load_controller(self.value('controller'), rig, accept_other_rig=True)
        return experiment_metadata(
            experiment, rig, controller, valve, None if seed == UNKNOWN_SEED else seed,
            origin='live', **driver_facts(), remarks='\n'.join(
                experiment.remarks(rig.valve, rig, controller)) if experiment and rig else '')

    def start(self) -> None:
        """Open the bag; wait until the publishers asked for are connected."""
        writer = BagWriter(
            self.value('output'), {'pam_experiment': self.metadata},
            overwrite=self.value('overwrite'),
            max_file_bytes=self.value('max_bagfile_size_bytes'),
            max_file_s=self.value('max_bagfile_duration_s'))
        self.watch = EndWatch(self.get_namespace().rstrip('/'))
        self.known: set[str] = set()
        self.core = RecorderCore(writer)
        if self._recorded or not self.value('autostart'):
            for source in self.sources.values():
                source.take()           # what came before belongs to no recording
            for name in self.latched:
                self._record_latched(name)
        # Who waited for this node to be there may have begun before it is active.
        self._recorded = True
        missing = self._wait_for_publishers()
        if missing:
            self.get_logger().warning(f'nobody publishes {", ".join(missing)} yet')
        self.get_logger().info(f'ready, recording to {self.value("output")}')
        self.add_loop(TAKE_PERIOD_S)

    def teardown(self) -> None:
        """Finish the bag of an activation that failed."""
        if self.core is not None:
            self._close()

    def _wait_for_publishers(self) -> list[str]:
        deadline = time.monotonic() + READY_TIMEOUT_S
        while True:
            missing = [topic for topic in self.value('await_topics')
                       if topic and not self._connected(self.sources[topic])]
            if not missing or self.stopping or time.monotonic() > deadline:
                return missing
            time.sleep(0.01)

    def _connected(self, source: PolledSubscription) -> bool:
        return source.publishers >= max(self.count_publishers(source.topic), 1)

    def tick(self) -> None:
        """Hand over what arrived."""
        self._take_all()
        if self._core.write_error:
            self._give_up()
        elif self.timing is not None and self.timing.ticks % CHECK_EVERY == 1:
            self._check_losses()
            self._look_for_latched()

    def _give_up(self) -> None:
        """
        End after a write error: keep what is written, tell everybody, exit with 1.

        An experiment without a record is not worth its risk; whoever started the rig sees
        this node end and stops the others, which vents.
        """
        summary = self._close()
        self.fail(f'{summary.write_error} ({summary.written} messages kept, '
                  f'{summary.dropped} not written)')

    def _check_losses(self) -> None:
        counts = self._core.counts.values()
        lost = sum(one.lost or 0 for one in counts)
        dropped = sum(one.dropped for one in counts)
        if lost or dropped:
            self.diagnostics.update(
                ERROR, f'recording, but {lost} messages were lost and {dropped} dropped')
        else:
            self.diagnostics.update(OK, 'recording')

    def _take_all(self) -> int:
        """Take what arrived on all topics; return how many messages it was."""
        taken = 0
        for topic, source in self.sources.items():
            messages = source.take()
            if not messages:
                continue
            name = source.topic
            if name not in self.known:
                self._core.add_topic(
                    name, self.types[topic], LATCHED if topic in self.latched else None)
                self.known.add(name)
            self._core.receive_all(name, messages)
            if topic == 'diagnostics':
                self._listen(messages)
            taken += len(messages)
        return taken

    def _listen(self, messages: Sequence[Taken]) -> None:
        """Follow how the run goes by what the other nodes say."""
        for data, _ in messages:
            with contextlib.suppress(InputError):
                self.watch.hear(decode('diagnostics', data))

    def _ending(self) -> Ending:
        """Return how the run ended, by what was heard and by who started this node."""
        told = None
        if self.value('notes_folder'):
            path = os.path.join(self.value('notes_folder'), ENDED_FILE)
            with contextlib.suppress(OSError, ValueError, TypeError), open(path) as stream:
                told = Ending(**json.load(stream))
        if self.failure and told is None:
            told = Ending(ended=RUN_FAILED, because=self.failure)
        return self.watch.ending(ending_of(self.metadata).planned_s, told)

    def _close(self) -> RecordingSummary:
        """Finish the bag; return the summary."""
        summary = self._core.close(self._ending())
        self.core = None
        if self.value('notes_folder'):
            try:
                write_text(os.path.join(self.value('notes_folder'), RECORDED_FILE),
                           json.dumps(summary.to_dict()))
            except InputError as error:
                self.get_logger().warning(str(error))
        return summary

    def stop(self) -> None:
        """Take the last messages, finish the bag, say whether it is complete."""
        if self.core is None:
            return
        try:
            self._take_last()
        finally:
            summary = self._close()
        silent = [self.sources[name].topic for name in self.extra
                  if self.sources[name].topic not in self.known]
        if silent:
            self.get_logger().warning(f'nothing came on {", ".join(silent)}')
        if summary.complete:
            self.get_logger().info(
                f'{summary.written} messages recorded, none lost{_before(summary)}: '
                f'{summary.path}')
            return
        self.result_code = 1
        self.get_logger().error(summary.write_error or (
            f'{summary.lost} messages lost and {summary.dropped} dropped, '
            f'{summary.written} recorded{_before(summary)}: {summary.path}'))

    def _take_last(self) -> None:
        begin = last = time.monotonic()
        while True:
            now = time.monotonic()
            if self._take_all():
                last = now
            farewell = self.stopping and now - begin < FAREWELL_S and self._others_publish()
            if now - last > QUIET_S and not farewell or now - begin > FAREWELL_S:
                return
            time.sleep(0.01)

    def _others_publish(self) -> bool:
        own = {DIAGNOSTICS: 1}
        return any(source.publishers > own.get(source.topic, 0)
                   for source in self.sources.values())

    def diagnostic_values(self) -> Values:
        """Add what was recorded."""
        values = super().diagnostic_values()
        if self.core is None:
            return values
        rows = [('queued', self.core.queued)]
        for name, counts in self.core.counts.items():
            rows.append((f'recorded.{name}', counts.received - counts.dropped))
            if counts.lost:
                rows.append((f'lost.{name}', counts.lost))
        return (*values, *rows)


def _before(summary: RecordingSummary) -> str:
    """Return in words how many messages came too early for the recorder, '' for none."""
    early = sum(counts.missed_at_start or 0 for counts in summary.counts.values())
    return f', {early} sent before the recorder was connected' if early else ''


def parse_extra_topic(text: str) -> tuple[str, str]:
    """Return name and type of ``NAME=TYPE``; InputError with a reason."""
    where = 'parameter extra_topics'
    name, _, type_name = text.partition('=')
    parts = type_name.split('/')
    if not name or len(parts) != 3 or parts[1] != 'msg':
        raise InputError(
            f'{text!r} is not NAME=TYPE, such as /bench/imu=sensor_msgs/msg/Imu', where)
    type_hash(type_name)
    try:
        message_class(type_name)
    except InputError as error:
        raise InputError(str(error), where) from None
    return name, type_name


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return its exit code."""
    return run(ExperimentRecorder, args)


if __name__ == '__main__':
    sys.exit(main())
