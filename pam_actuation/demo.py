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
The demo: the real nodes on DDS for both valves, then everything that can be done with a bag.

The steps are live tracking on the PPR with learning, the same with frozen rules, and live tracking
on the HSV pair. Then bags are checked with two independent readers and the controller is replayed.
A short offline tuning, the gap to the nominal model and one page follow. Every step is what the
``pam`` verbs do. The search of the gap and the independent readers take long. They begin as soon
as their bag is there, and run at low priority beside the next live run.

Where a computer stands still for some hundredths of a second, a watchdog vents, as it must. That
live run is made once more, with nothing beside it; what interrupted it is told.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
import os
from pathlib import Path
import shlex
import time
from typing import Any, TypeVar

import joblib
from pam_actuation.bags.check import independent_readers
from pam_actuation.bags.info import bag_info
from pam_actuation.bags.load import load_run
from pam_actuation.bags.place import check_bag_target
from pam_actuation.control.compiled_controller import CompiledController
from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.parallel import abandon, giving_way, in_processes, Results
from pam_actuation.replay.controller import replay_controller, ReplayResult
from pam_actuation.report.demo_page import demo_report, DemoPart
from pam_actuation.report.gap import FILES, free_run_overlay, write_gap
from pam_actuation.rigging.session import Result, run_experiment
from pam_actuation.tuning.tune import tune, TuneResult
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.files import check_folder, make_folder, StrPath
from pam_sim.gap import GapResult
from pam_sim.run import Run

R = TypeVar('R')
Progress = Callable[[float], None]      # takes the share that is done, 0 to 1
RIG = 'dmsp_5_300_realistic'
NOMINAL = 'dmsp_5_300_hanging_mass'
SEED = 1
GAP_SEARCH_S = 30.0         # longest; several effects of the realistic rig are missing
QUICK_GAP_SEARCH_S = 5.0
TUNING_ROLLOUTS = 150
BUSY = ('a live run was interrupted twice, so this computer may be too busy for live nodes: close '
        'other programs, then start the demo again')
TITLES = {'ppr_learning': 'PPR, learning', 'ppr_frozen': 'PPR, rules frozen',
          'hsv_learning': 'HSV, learning'}
TEXT_PPR = (
    'A proportional pressure regulator fills and vents the muscle, which lifts 5 kg along a '
    '0.25 Hz sine of 8 mm. The rig simulator has dead time, hysteresis, creep and sensor noise. '
    'The same experiment was run twice from the same rules: once while the controller rewrote '
    'them, once with learning frozen. The error per cycle falls only where the rules change.')
TEXT_HSV = (
    'The same muscle on a pair of high-speed on/off valves: the driver closes an inner pressure '
    'loop with pulse width modulation and shuts both valves at the set point, so that the '
    'controller sees the same interface.')


def check_place(folder: StrPath) -> None:
    """Look whether the demo can write into a folder; InputError where not, or over a file."""
    check_folder(folder, ('report.html', 'tuned.yaml'), overwrite=False)
    check_folder(os.path.join(folder, 'gap'), FILES, overwrite=False)
    for name in TITLES:
        check_bag_target(os.path.join(folder, name))


def gap_of_bag(bag: StrPath, folder: StrPath, seconds: float) -> GapResult:
    """Hold a recording against the nominal model; write the result folder."""
    return write_gap([load_run(bag)], NOMINAL, folder, seconds=seconds)


def interruptions(result: Result) -> list[str]:
    """Return what interrupted a live run, a sentence each; [] of one that went as it should."""
    told = [result.failure] if result.failure else (
        [] if result.complete else [f'{result.missing} messages were not recorded'])
    return told + result.findings


def kept(results: Results[R]) -> Results[R]:
    """Wait for the one result of ``in_processes``; return a generator that gives it."""
    one, = results
    return (again for again in (one,))


@dataclass
class DemoResult:
    """
    What the demo made and found.

    Attributes
    ----------
    folder, page : str
        Where everything is, and the page in it.
    bags : dict
        Key of ``TITLES`` to the folder of a recording.
    numbers : dict
        Title to the main numbers of that run, SI.
    findings : list of str
        What is wrong.
    repeated : list of str
        Which live runs were made once more, and what interrupted the first ones.
    busy : bool
        A live run was interrupted the second time as well.
    wall_s : float
        Time that all took [s].

    """

    folder: str
    page: str = ''
    bags: dict[str, str] = field(default_factory=dict)
    numbers: dict[str, dict[str, Any]] = field(default_factory=dict)
    findings: list[str] = field(default_factory=list)
    repeated: list[str] = field(default_factory=list)
    busy: bool = False
    wall_s: float = 0.0

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for ``--json``."""
        return {'folder': self.folder, 'page': self.page, 'bags': self.bags,
                'numbers': self.numbers, 'findings': self.findings, 'repeated': self.repeated,
                'wall_s': self.wall_s}

    def text(self) -> str:
        """Return the result for people."""
        lines = [f'done in {self.wall_s:.0f} s']
        for title, facts in self.numbers.items():
            cycles = facts.get('cycle_rmse_m') or []
            if len(cycles) > 1:
                lines.append(
                    f'{title}: tracking RMSE {1e3 * cycles[0]:.2f} mm in the first, '
                    f'{1e3 * cycles[-1]:.2f} mm in the last of {len(cycles)} cycles')
        lines += [f'repeated: {text}' for text in self.repeated]
        lines += [f'finding: {text}' for text in self.findings]
        lines += [f'bag: {bag}' for bag in self.bags.values()]
        lines.append(f'page: {self.page}')
        if self.busy:
            lines.append(f'next: {BUSY}')
        if 'ppr_learning' in self.bags:
            out = os.path.join(self.folder, 'investigation')
            lines.append('next, record until it is clear what the nominal model misses: pam '
                         f'investigate {shlex.quote(self.bags["ppr_learning"])} --rig {RIG} '
                         f'--out {shlex.quote(out)}')
        lines.append('see one live in the browser: pam run sine_quarter_hz --view')
        return '\n'.join(lines)


class Demo:
    """
    Runs the steps and keeps what they found.

    Parameters
    ----------
    folder : path
        Where bags and page go; made if needed.
    progress : callable
        Called with (share done 0..1, what is going on).
    quick : bool
        Two short cycles per live run in place of ten, and a short search of the gap: to see
        that everything works.

    """

    def __init__(self, folder: StrPath,
                 progress: Callable[[float, str], object] = lambda share, what: None,
                 quick: bool = False) -> None:
        self.result = DemoResult(folder=os.path.abspath(folder))
        self._progress = progress
        self._long, self._short = ('short_sine', 'short_sine') if quick else (
            'sine_quarter_hz', 'sine_quarter_hz_short')
        self._gap_search_s = QUICK_GAP_SEARCH_S if quick else GAP_SEARCH_S
        self._runs: dict[str, Run] = {}
        self._replays: dict[str, ReplayResult] = {}
        self._checks: list[list[str]] = []
        self._tuning: TuneResult | None = None
        self._gap: GapResult | None = None
        # What runs beside: name of a bag to the readers' counts, and the gap of the first.
        self._read: dict[str, Results[dict[str, dict[str, int]]]] = {}
        self._found: Results[GapResult] | None = None
        self._remark = ''           # on what is going on, beside the name of the step

    def run(self) -> DemoResult:
        """Run all steps and return the DemoResult."""
        started = time.perf_counter()
        make_folder(self.result.folder)
        steps = self._steps()
        total = sum(seconds for seconds, _, _ in steps)
        done = 0.0
        try:
            for seconds, what, step in steps:
                def inner(share: float, done: float = done, seconds: float = seconds,
                          what: str = what) -> None:
                    self._progress((done + seconds * share) / total, what + self._remark)
                self._remark = ''
                inner(0.0)
                step(inner)
                done += seconds
        finally:
            abandon(*filter(None, (self._found, *self._read.values())))
        self._progress(1.0, 'done')
        self.result.wall_s = time.perf_counter() - started
        return self.result

    def _steps(self) -> list[tuple[float, str, Callable[[Progress], object]]]:
        """Return (expected seconds, name, function) of each step."""
        return [
            (50, 'PPR, learning', lambda p: self._live('ppr_learning', self._long, True, p)),
            (49, 'PPR, rules frozen', lambda p: self._live('ppr_frozen', self._long, False, p)),
            (29, 'HSV, learning', lambda p: self._live('hsv_learning', self._short, True, p)),
            (4, 'replaying the controller', self._replay),
            (2, 'tuning offline', self._tune),
            (3, 'checking the bags', self._check),
            (1, 'gap between model and recording', self._look_at_gap),
            (2, 'writing the page', self._write_page),
        ]

    def _live(self, name: str, experiment: str, learning: bool, progress: Progress) -> None:
        """Run one experiment on live nodes, twice if it is interrupted, and load its bag."""
        result = self._recorded(name, experiment, learning, progress)
        first = interruptions(result)
        if first and not result.failure:
            self._remark = ', once more'
            progress(0.0)
            self._wait_for_what_runs_beside()
            result = self._recorded(name, experiment, learning, progress, overwrite=True)
            self.result.repeated.append(
                f'{TITLES[name]}: the first run was interrupted, so the numbers are those of a '
                f'second one. The first one said: {"; ".join(first)}')
            self.result.busy |= bool(interruptions(result))
        self.result.bags[name] = result.bag
        self.result.findings += [f'{TITLES[name]}: {text}' for text in interruptions(result)]
        self._read[name] = in_processes(2, [
            joblib.delayed(giving_way)(independent_readers, result.bag)])
        self._runs[name] = load_run(result.bag)
        if name == 'ppr_learning':
            self._found = in_processes(2, [joblib.delayed(giving_way)(
                gap_of_bag, result.bag, os.path.join(self.result.folder, 'gap'),
                self._gap_search_s)])

    def _recorded(self, name: str, experiment: str, learning: bool, progress: Progress,
                  overwrite: bool = False) -> Result:
        """Run one experiment on live nodes; return its Result, which has a bag."""
        valve = name.split('_')[0]
        result = run_experiment(
            experiment, RIG, f'sofc_{valve}', valve, os.path.join(self.result.folder, name),
            learning=learning, seed=SEED, overwrite=overwrite,
            progress=lambda done, whole: progress(done / whole))
        if result.stopped:
            raise KeyboardInterrupt
        if not result.bag:
            raise InputError(result.failure, TITLES[name])
        return result

    def _wait_for_what_runs_beside(self) -> None:
        """Let the readers and the search of the gap end; their results are kept."""
        for name, read in self._read.items():
            self._read[name] = kept(read)
        if self._found is not None:
            self._found = kept(self._found)

    def _check(self, progress: Progress) -> None:
        """Open every bag with readers this project did not write, and count."""
        for name, bag in self.result.bags.items():
            info, readers = bag_info(bag), next(self._read[name])
            counts = {topic.name: topic.count for topic in info.topics}
            self._checks.append([name, 'published = recorded', 'yes' if info.complete else 'no'])
            for reader, read in readers.items():
                same = read == counts
                self._checks.append([name, f'decoded by {reader}', (
                    f'{sum(read.values())} messages' if same else 'counts differ')])
                if not same:
                    self.result.findings.append(f'{name}: {reader} reads other counts')

    def _replay(self, progress: Progress) -> None:
        """Replay every recorded controller."""
        for name, run in self._runs.items():
            self._replays[name] = replay_controller(run)
            if not self._replays[name].identical:
                self.result.findings.append(
                    f'{TITLES[name]}: {self._replays[name].sentence()}')

    def _tune(self, progress: Progress) -> None:
        """Tune an untuned controller on the recorded rig and experiment, for a few seconds."""
        metadata = self._runs['ppr_learning'].metadata
        rig = load_rig(metadata['rig'])
        untuned = load_controller('sofc_untuned', rig)
        assert isinstance(untuned, CompiledController)      # of a rig, in no mode
        self._tuning = tune(
            rig, untuned, load_experiment(self._short),
            budget=TUNING_ROLLOUTS, seed=SEED,
            progress=lambda done: progress(done / TUNING_ROLLOUTS))
        self._tuning.save(Path(self.result.folder, 'tuned.yaml'))

    def _look_at_gap(self, progress: Progress) -> None:
        """Wait for what was found between the recording and the nominal model."""
        assert self._found is not None      # since the first live run
        self._gap = next(self._found)

    def _write_page(self, progress: Progress) -> None:
        """Put everything on one page."""
        runs, replays = self._runs, self._replays
        ppr = [(TITLES[name], runs[name]) for name in ('ppr_learning', 'ppr_frozen')]
        hsv = [(TITLES['hsv_learning'], runs['hsv_learning'])]
        parts = []
        for title, text, named, name in (
                ('Proportional pressure regulator', TEXT_PPR, ppr, 'ppr_learning'),
                ('High-speed on/off valves', TEXT_HSV, hsv, 'hsv_learning')):
            run = runs[name]
            parts.append(DemoPart(
                title, text, named,
                rules_before=load_controller(run.metadata['controller']).rules,
                rules_after=replays[name].controller.rules,
                overlay=free_run_overlay(run, load_rig(run.metadata['rig'])),
                replays=[(TITLES[n], replays[n]) for n in replays
                         if n.startswith(name.split('_')[0])]))
        self.result.page = os.path.join(self.result.folder, 'report.html')
        self.result.numbers = demo_report(
            self.result.page, parts, tuning=self._tuning, gap=self._gap, checks=self._checks,
            notes=[f'Repeated: {text}.' for text in self.result.repeated] + self.result.findings)
