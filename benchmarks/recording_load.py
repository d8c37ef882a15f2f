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
Record a fast rig on live nodes: whether all is there, and what the recorder costs.

    python benchmarks/recording_load.py --seconds 600
    python benchmarks/recording_load.py --seconds 120 --extra 8

Plant at 1 kHz, controller at 500 Hz, all topics of the rig, and with ``--extra`` so many
topics of 1 kHz more from a process of their own. Prints messages published and recorded
per topic, what was lost or dropped, and the processor time of the recorder (share of one
core, from /proc). Exit code 1 if the run fails, a message is missing, or the recorder costs too
much or its cost is not known. A run that fails leaves the page as it is.
"""

import argparse
import json
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
import time

from pam_actuation.bags.info import bag_info
from pam_actuation.rigging import session
from pam_actuation.rigging.plan import make_plan, PLANT, RECORDER
from pam_actuation.rigging.processes import node_environment
import results_page
import yaml

PLANT_HZ, CONTROLLER_HZ, EXTRA_HZ = 1000.0, 500.0, 1000.0
EXTRA_TYPE = 'sensor_msgs/msg/FluidPressure'
ALLOWED_SHARE = 0.35
LEAD_IN_S = 2.0
LARGEST_BURST = 20


def experiment_text(seconds):
    """Return an experiment of the wanted length: a slow sine."""
    return (f'name: load\ndomain: contraction\nsegments:\n'
            f'  - rest: {{duration_s: {LEAD_IN_S}}}\n'
            '  - ramp: {to_m: 0.014, duration_s: 2.0}\n'
            '  - sine: {center_m: 0.014, amplitude_m: 0.004, frequency_hz: 0.25, '
            f'cycles: {max(round((seconds - 4.0) / 4.0), 1)}}}\n')


def fast_controller(rate_hz):
    """Return the text of the fuzzy controller's preset at another rate."""
    from pam_actuation.control.config import load_controller
    from pam_sim import load_rig
    plain = yaml.safe_load(
        load_controller('sofc_ppr', load_rig('dmsp_5_300_realistic')).to_yaml())
    plain['settings']['rate_hz'] = rate_hz
    plain.pop('initial_rules', None)        # learned at the preset's own rate
    return yaml.safe_dump(plain, sort_keys=False)


def publish_extra(count):
    """
    Publish ``count`` topics of 1 kHz until SIGTERM, then tell how many (own process).

    Begins with a line on stdin: what is sent before the recorder is active is not recorded.
    """
    from pam_actuation.topics.codec import encode
    from pam_actuation.messages import Pressure
    from pam_actuation.nodes.endpoints import CountedPublisher
    from pam_actuation.nodes.endpoints import wait_until_matched
    import rclpy
    from rclpy.signals import SignalHandlerOptions
    from sensor_msgs.msg import FluidPressure
    stopped = []
    signal.signal(signal.SIGTERM, lambda *_: stopped.append(True))
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node('extra')
    publishers = [CountedPublisher(node, FluidPressure, name) for name in extra_names(count)]
    wait_until_matched(publishers, f'/muscle/{RECORDER}', 60.0, lambda: stopped)
    sys.stdin.readline()
    begin, sent = time.monotonic(), 0
    while not stopped:
        now = time.monotonic()
        due = int((now - begin) * EXTRA_HZ)
        if due - sent > LARGEST_BURST:          # a sensor does not make up for a pause either
            begin = now - (sent + LARGEST_BURST) / EXTRA_HZ
            due = sent + LARGEST_BURST
        while sent < due:
            payload = encode('pressure', Pressure(time.time_ns(), 2e5 + sent))
            for publisher in publishers:
                publisher.publish(payload)
            sent += 1
        time.sleep(0.001)
    for publisher in publishers:
        publisher.wait_for_all_acked(2.0)
    print(json.dumps({publisher.topic: publisher.count for publisher in publishers}))
    time.sleep(0.5)


def extra_names(count):
    """Return the names of the extra topics."""
    return [f'/extra/sensor_{k}' for k in range(count)]


def measure(seconds, extra, bag):
    """
    Run the rig for some seconds.

    Returns
    -------
    dict
        Counts per topic, what is missing, and the load.

    """
    controller = Path(bag).with_suffix('.controller.yaml')
    controller.write_text(fast_controller(CONTROLLER_HZ))
    plan = make_plan(
        experiment_text(seconds), 'dmsp_5_300_realistic', str(controller), 'ppr', str(bag))
    plan.parameters[PLANT]['publish_rate_hz'] = PLANT_HZ
    if extra:
        plan.parameters[RECORDER]['extra_topics'] = [
            f'{name}={EXTRA_TYPE}' for name in extra_names(extra)]
    result = session.Result(str(bag))
    sender = None
    told = {}
    try:
        with session.RigSession(plan) as rig:
            if extra:
                environment = node_environment(rig.domain_id, plan.folder)
                sender = subprocess.Popen(
                    [sys.executable, __file__, '--publish', str(extra)], env=environment,
                    stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
                    start_new_session=True)
                _stop_extra_before_the_recorder(rig, sender, told)
            session.run_guarded(rig, result, None if sender is None else _starter(sender))
    finally:
        plan.remove()
        if sender is not None and sender.poll() is None:
            sender.terminate()
            sender.wait(10.0)
    return _figures(bag, result, told)


def _starter(sender):
    """Return a progress function whose first call lets the extra publisher begin."""
    begun = []

    def begin(done_s, total_s):
        if not begun:
            begun.append(done_s)
            sender.stdin.write('go\n')
            sender.stdin.flush()

    return begin


def _stop_extra_before_the_recorder(rig, sender, told):
    """Let the session stop the extra publisher when it begins to stop the nodes."""
    finish = rig.finish

    def stop_then_finish():
        sender.send_signal(signal.SIGTERM)
        told.update(json.loads(sender.stdout.readline() or '{}'))
        return finish()

    rig.finish = stop_then_finish


def _figures(bag, result, told):
    info = bag_info(bag)
    published = {**result.published, **told}
    topics = {
        topic.name: {
            'published': published.get(topic.name), 'recorded': topic.count,
            'rate_hz': topic.rate_hz and round(topic.rate_hz, 1), 'lost': topic.lost,
            'dropped': topic.dropped, 'missed_at_start': topic.missed_at_start}
        for topic in info.topics}
    return {
        'failure': result.failure, 'findings': result.findings,
        'duration_s': round(info.duration_s, 1), 'messages': info.message_count,
        'messages_per_s': round(info.message_count / max(info.duration_s, 1e-9)),
        'megabytes': round(info.size_bytes / 1e6, 1),
        'missing': sum(counts['published'] - counts['recorded'] for counts in topics.values()
                       if counts['published'] is not None),
        'dropped': info.dropped, 'lost': info.lost, 'missed_at_start': info.missed_at_start,
        'recorder_share_of_a_core': result.cpu_share.get(RECORDER),
        'cpu_share': result.cpu_share, 'topics': topics}


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--seconds', type=float, default=60.0)
    parser.add_argument('--extra', type=int, default=0, help='further topics of 1 kHz')
    parser.add_argument('--publish', type=int, default=0, help=argparse.SUPPRESS)
    results_page.add_write(parser, 'recording')
    return parser


def show(found):
    """Print the figures as a table."""
    share = found['recorder_share_of_a_core']
    cost = 'not known' if share is None else f'{share:.2f}'
    print('| duration | messages | a second | missing | lost | dropped | missed at start '
          '| recorder, share of a core |\n|---|---|---|---|---|---|---|---|')
    print(f'| {found["duration_s"]} s | {found["messages"]} | {found["messages_per_s"]} '
          f'| {found["missing"]} | {found["lost"]} | {found["dropped"]} '
          f'| {found["missed_at_start"]} | {cost} |')


def main():
    """Measure and judge."""
    args = command_line().parse_args()
    if args.publish:
        return publish_extra(args.publish)
    with results_page.printed(args, __file__, 'extra' if args.extra else ''):
        with tempfile.TemporaryDirectory() as folder:
            found = measure(args.seconds, args.extra, os.path.join(folder, 'load'))
        print(json.dumps(found, indent=2), file=sys.stderr)
        if found['failure']:
            raise SystemExit(found['failure'])      # and the page keeps its former table
        show(found)
    share = found['recorder_share_of_a_core']
    good = not found['missing'] and not found['dropped']
    return 0 if good and share is not None and share < ALLOWED_SHARE else 1


if __name__ == '__main__':
    sys.exit(main())
