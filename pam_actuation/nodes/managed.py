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
The managed node all nodes of the rig are made from.

States and what they mean: *configure* reads the parameters and builds the plain
objects with safe outputs; *activate* starts the loop from the present state;
*deactivate* stops it and makes the output safe; *cleanup* drops everything;
*shutdown* from any state makes the output safe. A node started by plain
``ros2 run`` goes to active by itself; with ``autostart:=false`` it waits for
``change_state``. An exception in a transition or in the loop is logged, makes the
output safe and ends the node's work.
"""

from collections.abc import Callable, Iterable
import gc
import time
import traceback
from typing import Any

from pam_actuation.messages import ACTIVE, CONFIGURED, DEACTIVATED
from pam_actuation.namespaces import node_name_of
from pam_actuation.nodes import lockstep
from pam_actuation.nodes import qos
from pam_actuation.nodes.diagnostics import DiagnosticsReporter, ERROR, OK, Values
from pam_actuation.nodes.endpoints import CountedPublisher, PolledSubscription, wait_until_matched
from pam_actuation.nodes.lockstep import TickInput, TickInputs
from pam_actuation.nodes.loops import Loop, LoopSet, LoopTime, NOT_SERVED, SteadyTime
from pam_actuation.nodes.node_log import LoggedNode
from pam_actuation.nodes.parameters import COMMON_PARAMETERS, declare, unused_qos
from pam_actuation.nodes.realtime import run_in_realtime
from pam_actuation.nodes.ros_messages import class_of
from pam_actuation.nodes.simulated_time import FollowedTime, leave_clock_to_node, PlantTime
from pam_actuation.nodes.timing import LoopTiming
from pam_actuation.nodes.transitions import refuse_impossible_transitions
from pam_actuation.topics.codec import Reader, Writer
from pam_actuation.topics.quality import Quality
from pam_actuation.topics.table import topic_of
from pam_sim.errors import InputError
from pam_sim.parameters import Parameter
from rclpy.lifecycle import LifecycleState
from rclpy.lifecycle import TransitionCallbackReturn

EVERY_TICK_S = 1e-9     # in lockstep: due at every clock message
FAREWELL_S = 0.1        # for the last messages to be confirmed; many receivers confirm later


class StoppedEarly(Exception):
    """A signal came while a transition was under way."""


class ManagedNode(LoggedNode):
    """
    A lifecycle node with one loop, counted publishers and diagnostics.

    Derived nodes set ``NAME`` and ``PARAMETERS`` and override ``check``, ``setup``, ``start``,
    ``tick``, ``safe_stop``, ``stop`` and ``teardown`` as far as they need them.
    """

    NAME = ''
    STUCK_AFTER_S = 2.0         # how long the way out may take
    REALTIME_RANK = 0           # added to a real-time priority: among equals nobody gives way
    SPEAKS_AT_ONCE = True       # in /diagnostics, also before it is active
    FOLLOWS_CLOCK = True        # whether the loops run on simulated time with use_sim_time
    PARAMETERS: tuple[Parameter, ...] = ()
    LIVE: tuple[str, ...] = ()  # names of those that may change while it runs

    def __init__(self, **kwargs: Any) -> None:
        self.publishers_counted: list[CountedPublisher] = []
        # Not None: the process is to end now, with this code.
        self.exit_code: int | None = None
        self.result_code = 0        # with which it ends otherwise
        self.stopping = False
        self.failure = ''           # why the node failed while active
        self._active = False        # from start to the end of its work
        # The user's mistake that stopped the last transition.
        self.input_error: InputError | None = None
        self.timing: LoopTiming | None = None
        self._writers: dict[str, tuple[CountedPublisher, Writer]] = {}
        self.subscriptions_polled: list[PolledSubscription] = []
        self.loops = LoopSet()
        super().__init__(self.NAME, **kwargs)
        refuse_impossible_transitions(self)
        declare(self, (*COMMON_PARAMETERS, *self.PARAMETERS), self.LIVE)
        self.awaited = self.value('await_subscriber') and node_name_of(
            self.value('await_subscriber'), self.get_namespace().rstrip('/'),
            'parameter await_subscriber')
        self.participants = self._participants()
        self.simulated_time: FollowedTime | PlantTime | None = None
        if self.FOLLOWS_CLOCK and self.uses_simulated_time:
            leave_clock_to_node(self)
        self.diagnostics = DiagnosticsReporter(self)
        self.diagnostics.silent = bool(self.awaited) or not self.SPEAKS_AT_ONCE
        self.check()

    # What derived nodes override.

    @staticmethod
    def controller_settings() -> tuple[Parameter, ...]:
        """Return the settings that its controller files know, for its page."""
        return ()

    def check(self) -> None:
        """Raise InputError if the parameters given at start do not make sense."""

    def setup(self) -> None:
        """Build the plain objects, publishers and subscriptions (configure)."""

    def start(self) -> None:
        """Prepare for the first tick (activate)."""

    def tick(self) -> None:
        """Run once per period of the loop."""

    def due(self, since_last_s: float) -> bool:
        """Tell whether to tick now; asked only by a loop with ``poll_s``."""
        return True

    def safe_stop(self, why: str) -> None:
        """Make the output safe; called on every way out, perhaps more than once."""

    def stop(self) -> None:
        """Finish work after safe output and last diagnostics (deactivate)."""

    def teardown(self) -> None:
        """Drop what ``setup`` built, apart from publishers and subscriptions (cleanup)."""

    def make_simulated_time(self) -> FollowedTime | PlantTime:
        """Return the time the loops run on with use_sim_time."""
        return FollowedTime(self, self.tick_inputs())

    def inputs_of_a_tick(self) -> list[TickInput]:
        """Return what a tick waits for in lockstep, see ``lockstep``."""
        return []

    def diagnostic_values(self) -> Values:
        """Return (key, value) pairs that every status of this node shows."""
        lost = ((f'lost.{one.topic}', one.lost) for one in self.subscriptions_polled)
        return (*(self.timing.values() if self.timing else ()), *lost)

    # What derived nodes use.

    def value(self, name: str) -> Any:
        """Return the value of a parameter."""
        return self.get_parameter(name).value

    def now_ns(self) -> int:
        """Return the time for stamps [ns]: ROS time, simulated if use_sim_time is set."""
        if self.simulated_time is not None:
            return self.simulated_time.now_ns()
        return self.get_clock().now().nanoseconds

    @property
    def uses_simulated_time(self) -> bool:
        """Tell whether this node was started with use_sim_time."""
        return bool(self.get_parameter('use_sim_time').value)

    def tick_inputs(self, patience_s: float = lockstep.LEFT_OUT_AFTER_S) -> TickInputs:
        """Return the ``TickInputs`` of this node."""
        return TickInputs(
            self.inputs_of_a_tick, bool(self.participants), self.get_logger().warning, patience_s)

    def topics_sent(self) -> list[tuple[str, CountedPublisher]]:
        """Return (short topic name, publisher) of all topics of the rig this node sends."""
        return [(topic, publisher) for topic, (publisher, _) in self._writers.items()]

    def _participants(self) -> tuple[str, ...]:
        """Return the nodes in lockstep; InputError if that is not possible."""
        names = lockstep.participants_of(self.value('lockstep'))
        if names and not self.uses_simulated_time:
            raise InputError('lockstep is in simulated time, set use_sim_time', 'use_sim_time')
        return names if self.NAME in names else ()

    def add_publisher(self, topic: str) -> None:
        """Create the publisher of a topic of the rig; ``send`` publishes on it."""
        publisher = CountedPublisher(
            self, class_of(topic), topic, qos.profile(topic_of(topic).service.publisher))
        self.publishers_counted.append(publisher)
        self._writers[topic] = publisher, Writer(
            topic, self.value('muscle'), self.value('frame_id'))

    def send(self, topic: str, plain: Any) -> None:
        """Publish a plain message."""
        publisher, writer = self._writers[topic]
        publisher.publish(writer.fill(plain))

    def add_subscription(self, topic: str, plain: bool = True,
                         writers: bool = False) -> PolledSubscription:
        """
        Create and return a polled subscription of a topic of the rig.

        It gives plain messages; without ``plain`` the bytes, as they came. With ``writers`` the
        info of each tells who wrote it.
        """
        return self.subscribe(
            class_of(topic), topic, topic_of(topic).service.consumer,
            Reader(topic) if plain else None, writers)

    def subscribe(self, message_type: Any, name: str, quality: Quality,
                  read: Callable[[bytes], Any] | None = None,
                  writers: bool = False) -> PolledSubscription:
        """
        Create and return a polled subscription of any topic, which takes bytes.

        ``quality`` is that of ``topics/quality.py``; ``read``, ``writers``: as of
        ``PolledSubscription``.
        """
        subscription = PolledSubscription(
            self, message_type, name, qos.profile(quality), raw=True, read=read, writers=writers)
        self.subscriptions_polled.append(subscription)
        return subscription

    def discard_arrived(self) -> None:
        """Take what waits in the subscriptions and forget it."""
        for subscription in self.subscriptions_polled:
            subscription.take()

    def add_loop(self, period_s: float, poll_s: float | None = None) -> None:
        """
        Run ``tick`` every ``period_s`` on the steady clock while active.

        With ``poll_s`` the node asks itself that often, by ``due``, whether to tick. On simulated
        time it does not; in lockstep it ticks with every clock message, whatever its period.
        """
        self.timing = LoopTiming(period_s)
        if self.participants:
            self.loops.add(EVERY_TICK_S, self._timed_tick)
        elif poll_s is None or self.simulated_time is not None:
            self.loops.add(period_s, self._timed_tick)
        else:
            self.loops.add(poll_s, self._polled_tick)

    def add_extra_loop(self, period_s: float, callback: Callable[[], object],
                       clock: LoopTime | None = None) -> Loop:
        """Run something else than ``tick`` every ``period_s`` while active; return the loop."""
        return self.loops.add(period_s, lambda: self._guarded(callback), clock)

    def _polled_tick(self) -> None:
        assert self.timing is not None
        since_last_s = self.timing.since_last_s(time.monotonic_ns())
        if self._guarded(lambda: self.due(since_last_s)):
            self._timed_tick()

    def _timed_tick(self) -> None:
        timing = self.timing
        assert timing is not None
        timing.begin(time.monotonic_ns())
        self._guarded(self.tick)
        timing.end(time.monotonic_ns())

    def _guarded(self, action: Callable[[], Any]) -> Any:
        """Return what a part of the loop returns; if it fails, the node fails safely."""
        try:
            return action()
        except KeyboardInterrupt:
            raise
        except BaseException as error:      # SystemExit too: the output is made safe first
            self.fail(f'the loop of this node failed: {error}', traceback.format_exc())
            return None

    def fail(self, why: str, details: str = '') -> None:
        """Make the output safe, say why and end the process with exit code 1."""
        self.failure = self.failure or why
        self._make_safe(why)
        self._end_loops()
        self.exit_code = 1
        self.diagnostics.update(ERROR, self.last_status(why)[1])
        # Last: the log waits for a terminal that is held, and all threads of the node with it.
        self.get_logger().error(f'{why}\n{details}' if details else why)

    def _make_safe(self, why: str) -> None:
        """Call ``safe_stop``; a fault in it must not stop the way out."""
        try:
            self.safe_stop(why)
        except Exception:
            self.get_logger().error(f'the safe stop failed:\n{traceback.format_exc()}')

    def _end_loops(self) -> None:
        self.loops.clear()
        if self.simulated_time is not None:
            self.simulated_time.end()
        if self.timing:
            self.timing.pause()

    def finish(self, why: str) -> None:
        """Leave safely from whatever state: the end of every process comes through here."""
        with self.loops.lock:
            if self._leave(why):
                if self.failure:
                    self.get_logger().error(self.failure)
                else:
                    self.get_logger().info(why)
            self._farewell()

    def _leave(self, why: str) -> bool:
        """End the node's work, tell what fails meanwhile; return whether it was active."""
        was_active = self._active
        try:
            self._end_work(why)
        except Exception:
            self.result_code = 1
            self.get_logger().error(f'the end of the work failed:\n{traceback.format_exc()}')
        return was_active

    def last_status(self, why: str) -> tuple[int, str, Values]:
        """Return level, message and values of the last status of all."""
        return ERROR if self.exit_code else OK, why, self.diagnostics.values_of()

    def _end_work(self, why: str) -> None:
        """Make the output safe; a node that was active sends its last status and stops."""
        was_active, self._active = self._active, False
        self._end_loops()
        self._make_safe(why)
        if was_active:
            try:
                self.diagnostics.end(*self.last_status(self.failure or why))
            finally:
                self.stop()

    def _farewell(self) -> None:
        """Wait a little until everybody has what was sent last."""
        deadline = time.monotonic() + FAREWELL_S
        for publisher in (*self.publishers_counted, self.diagnostics.publisher):
            publisher.wait_for_all_acked(max(deadline - time.monotonic(), 0.0))

    def destroy_node(self) -> None:
        """
        Destroy everything of this node in the middleware.

        rclpy 7.1 leaves the state machine, whose publisher and services keep the participant
        alive until the process ends. There Fast DDS takes its tables down under the threads
        that still receive, which now and then ended a process by a segmentation fault.
        """
        super().destroy_node()      # type: ignore[no-untyped-call]  # rclpy has no annotations
        del self._state_machine

    # Transitions: each is wrapped, since rclpy swallows exceptions without a word.

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Read parameters, build everything with safe outputs."""
        return self._transition('configure', self._configure)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Wait for the receivers that must not miss anything, start the loop."""
        return self._transition('activate', self._activate)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop the loop, make the output safe."""
        return self._transition('deactivate', self._deactivate)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Drop everything."""
        return self._transition('cleanup', self._cleanup)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Make the output safe and end the process."""
        self.exit_code = self.exit_code or 0
        return self._transition('shutdown', self._deactivate)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Make the output safe after a failed transition; the node is unconfigured then."""
        self._leave('a transition failed')
        self._farewell()
        return self._transition('recover', self._cleanup)

    def _transition(self, word: str, action: Callable[[], object]) -> TransitionCallbackReturn:
        try:
            with self.loops.lock:
                action()
            return TransitionCallbackReturn.SUCCESS
        except StoppedEarly:
            return TransitionCallbackReturn.FAILURE
        except InputError as error:
            self.input_error = error
            self.diagnostics.update(ERROR, f'cannot {word}: {error}')
            if action == self._configure:
                self._undo_setup()
            elif self.loops:
                self._end_loops()
                self._make_safe(f'cannot {word}: {error}')
            self.get_logger().error(f'cannot {word}: {error}')
            return TransitionCallbackReturn.FAILURE
        except Exception as error:
            details = traceback.format_exc()
            self._end_loops()
            self._make_safe(f'cannot {word}: {error}')
            self.diagnostics.update(ERROR, f'cannot {word}: {error}')
            self.get_logger().error(f'cannot {word}:\n{details}')
            return TransitionCallbackReturn.ERROR

    def _configure(self) -> None:
        self.input_error = None
        self.setup()
        if self.FOLLOWS_CLOCK and self.uses_simulated_time:
            self.simulated_time = self.loops.time = self.make_simulated_time()
        for sentence in unused_qos(self):
            self.get_logger().warning(sentence)
        self.diagnostics.update(OK, CONFIGURED)

    def _activate(self) -> None:
        self._await_subscriber()
        gc.collect()
        gc.freeze()                  # what exists now stays: no long collections in the loop
        run_in_realtime(
            self.value('realtime_priority'), self.REALTIME_RANK, self.get_logger())
        if self.simulated_time is not None:
            self._await_participants()
            self.simulated_time.begin()
        for subscription in self.subscriptions_polled:
            subscription.resume()
        self.start()
        self._active = True
        self.diagnostics.silent = False
        # Also while a simulated time stands still.
        steady = None if self.simulated_time is None else SteadyTime()
        self.add_extra_loop(self.value('diagnostics_period_s'), self._report, steady)
        self.diagnostics.update(OK, ACTIVE)
        if not self.loops.served:
            self.diagnostics.remark = NOT_SERVED
            self.diagnostics.send()         # no loop does
        self.get_logger().info('active')

    def _report(self) -> None:
        own = self.get_name(), self.get_namespace()
        count = self.get_node_names_and_namespaces().count(own)
        # What was killed before this node began is not on its graph.
        remarks = [] if count < 2 else [
            f'{count} nodes are named {self.get_fully_qualified_name()}, end all but one']
        remarks += [text for one in self.subscriptions_polled for text in one.remarks()]
        remarks += self.simulated_time.remarks() if self.simulated_time is not None else []
        self.diagnostics.remark = '; '.join(remarks)
        self.diagnostics.send()

    def _await_subscriber(self) -> None:
        if self.awaited:
            publishers = (*self.publishers_counted, self.diagnostics.publisher)
            self._await_matched(publishers, self.awaited, 'await_subscriber')

    def _await_participants(self) -> None:
        """Wait until those in lockstep with this node receive what they need of it."""
        for publisher, name in lockstep.connections(self, self.participants):
            self._await_matched([publisher], name, 'lockstep')

    def _await_matched(self, publishers: Iterable[CountedPublisher], subscriber: str,
                       parameter: str) -> None:
        missed = wait_until_matched(
            publishers, subscriber, self.value('await_timeout_s'), lambda: self.stopping,
            self.get_logger().info)
        if missed and self.stopping:
            raise StoppedEarly
        if missed:
            raise InputError(
                f'{subscriber} does not receive {", ".join(missed)}', f'parameter {parameter}')

    def _deactivate(self) -> None:
        self._end_work(DEACTIVATED)

    def _cleanup(self) -> None:
        if self.simulated_time is not None:
            self.simulated_time.close()
            self.simulated_time, self.loops.time = None, SteadyTime()
        self.teardown()
        self._drop_endpoints()

    def _undo_setup(self) -> None:
        """Take back what a configure that failed has built, as far as it came."""
        try:
            self.teardown()
        except AttributeError as error:
            self.get_logger().debug(f'not built yet: {error}')
        except Exception as error:
            self.get_logger().warning(f'not all was taken back: {error}')
        self._drop_endpoints()

    def _drop_endpoints(self) -> None:
        for publisher in self.publishers_counted:
            publisher.destroy()
        for subscription in self.subscriptions_polled:
            subscription.destroy()
        self.publishers_counted, self.subscriptions_polled, self._writers = [], [], {}
