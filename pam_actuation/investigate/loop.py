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

"""The investigation: rounds of recording and looking, until an answer or the end of the budget."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import time
from typing import Any, TYPE_CHECKING

from pam_actuation.bags.load import load_run
from pam_actuation.investigate.decide import (
    decide, Decision, DECLINED, ENDINGS, FAILED, IMPOSSIBLE, MINUTES, ROUNDS)
from pam_actuation.investigate.outcome import Outcome
from pam_actuation.investigate.recorder import Declined, Recorder, RecordingFailed
from pam_actuation.investigate.rounds import Round, ROUND_FILE
from pam_actuation.investigate.store import Store
from pam_actuation.report.gap import gap_of, save_gap
from pam_actuation.report.signals import duration_s
from pam_sim.errors import InputError
from pam_sim.files import StrPath, write_json

if TYPE_CHECKING:
    from pam_actuation.bags.load import RecordedRun
    from pam_actuation.experiments.experiment import Experiment
    from pam_actuation.investigate.question import Question

STOPPED = 'stopped; finished rounds are kept, and the same command goes on from there'
GIVEN = 'It was there before.'
RECORDING_SHARE = 0.3         # of the progress of a round
LONGEST_SEARCH_S = 3600.0     # of one look, so that a slow machine finds what a fast one finds

Report = Callable[[float, str], object]     # takes the share that is done, 0 to 1, and the step


@dataclass(frozen=True)
class Budget:
    """
    How much may be spent.

    Parameters
    ----------
    rounds : int
        In all, those of earlier runs included.
    minutes : float
        Of this run. No round begins later; one that has begun is finished.

    """

    rounds: int = 4
    minutes: float = 60.0


class Investigation:
    """
    One question, worked on round by round.

    Parameters
    ----------
    question : Question
        What is asked.
    recorder : Recorder
        What records.
    folder : path
        Holds everything; what is there already is not done again.
    budget : Budget
        How much may be spent.
    overwrite : bool
        Whether the investigation of another question in this folder may be replaced.
    report : callable
        Told the share that is done and the step.
    given : sequence of RecordedRun, optional
        The recordings of the question, where they are loaded already.

    Raises
    ------
    InputError
        A recording cannot be read, the rig cannot do the first experiment, or the folder is not
        free.

    """

    def __init__(self, question: 'Question', recorder: Recorder, folder: StrPath,
                 budget: Budget | None = None, overwrite: bool = False,
                 report: Report = lambda share, step: None,
                 given: 'Sequence[RecordedRun]' = ()) -> None:
        self._question, self._recorder = question, recorder
        self._budget, self._overwrite, self._report = budget or Budget(), overwrite, report
        self._store = Store(folder)
        self._asked = question.to_dict(self._store.folder, recorder.to_dict())
        self._store.check(self._asked, overwrite)
        if not question.given:
            recorder.check(question.experiment)
        self._given = given
        self._runs: dict[int, list[RecordedRun]] = {}      # by round, read once

    def run(self) -> Outcome:
        """
        Work until an answer, or until the budget is spent; write the results.

        Returns
        -------
        Outcome

        Raises
        ------
        InputError
            A recording cannot be used at all, or the folder cannot be written.
        KeyboardInterrupt
            Ctrl-C. The finished rounds are kept; the same investigation goes on with the next.

        """
        deadline = time.monotonic() + 60.0 * self._budget.minutes
        with self._store.locked(self._asked, self._overwrite):
            rounds = self._store.read()
            if rounds and rounds[-1].verdict == 'refused' and self._recorder.is_live \
                    and self._store.set_aside(rounds[-1].number):
                rounds.pop()        # recorded again: a person may have mended the rig
            ended, because = '', ''
            while not ended:
                try:
                    ended, because = self._round(rounds, deadline)
                except KeyboardInterrupt:
                    raise KeyboardInterrupt(STOPPED) from None
            outcome = Outcome(self._asked, tuple(rounds), ended, because or ENDINGS[ended])
            outcome.write(self._store)
        self._report(1.0, 'done')
        return outcome

    def _round(self, rounds: list[Round], deadline: float) -> tuple[str, str]:
        """Add a round, or return how the investigation ended and why, ('', '') if it did not."""
        number = len(rounds) + 1
        given = bool(self._question.given) and not rounds
        decision = decide(rounds, self._question.experiment)
        ended = decision.ended or self._spent(number, deadline)
        if ended:
            return ended, ''
        if not given and self._store.bag(number) is None:
            assert decision.experiment is not None       # of a decision that goes on
            try:
                self._recorder.check(decision.experiment)
            except InputError as error:
                if not rounds:
                    raise
                return IMPOSSIBLE, str(error)
            try:
                self._record(number, decision.experiment, decision.why)
            except Declined as error:
                return DECLINED, str(error)
            except RecordingFailed as error:
                return FAILED, str(error)
        rounds.append(self._look(number, given, decision))
        return '', ''

    def _spent(self, number: int, deadline: float) -> str:
        """Return which part of the budget does not allow another round, '' for none."""
        if number > self._budget.rounds:
            return ROUNDS
        return MINUTES if time.monotonic() > deadline else ''

    def _told(self, number: int, low: float, high: float, step: str) -> Callable[[float], None]:
        """Return what a step of a round tells its share to."""
        def tell(share: float) -> None:
            inner = low + (high - low) * min(max(share, 0.0), 1.0)
            self._report((number - 1 + inner) / max(self._budget.rounds, number),
                         f'round {number}: {step}')
        tell(0.0)
        return tell

    def _record(self, number: int, experiment: 'Experiment', why: str) -> None:
        """Record the experiment of a round."""
        tell = self._told(number, 0.0, RECORDING_SHARE, f'recording {experiment.name}')
        began = time.perf_counter()
        with self._store.new_bag(number) as bag:
            self._recorder.record(
                experiment, bag, self._question.seed + number - 1, why, tell)
        self._store.told_time(number, 'recording', time.perf_counter() - began)

    def _look(self, number: int, given: bool, decision: Decision) -> Round:
        """Find the gap of all recordings so far, and keep it as a round."""
        tell = self._told(number, RECORDING_SHARE, 1.0, 'finding the gap')
        began = time.perf_counter()
        new = self._read(number, given)
        runs = [run for k in range(1, number) for run in self._runs_of(k)] + new
        model = self._question.model
        result = gap_of(
            runs, model, played=self._played(number), effects=self._question.effects or None,
            materiality=self._question.materiality, seconds=LONGEST_SEARCH_S, progress=tell)
        result.runtime_s = 0.0
        name = '' if given or decision.experiment is None else decision.experiment.name
        found = Round(number, tuple(
            {'path': run.path, 'experiment': run.metadata.get('experiment_name', '') or name,
             'duration_s': round(duration_s(run), 3)} for run in new),
            GIVEN if given else decision.why, {})
        with self._store.new_round(number) as folder:
            save_gap(result, runs, folder)
            write_json(folder / ROUND_FILE, found.facts())
        self._store.told_time(number, 'gap', time.perf_counter() - began)
        return Round.read(self._store.rounds / str(number))

    def _played(self, number: int) -> list[str]:
        """Return the names of the experiments of all recordings up to a round."""
        return [run.metadata.get('experiment_name', '')
                for k in range(1, number + 1) for run in self._runs_of(k)]

    def _runs_of(self, number: int) -> list['RecordedRun']:
        return self._read(number, number == 1 and bool(self._question.given))

    def _read(self, number: int, given: bool) -> list['RecordedRun']:
        """Return the recordings of a round; their paths are told as seen from the folder."""
        if number not in self._runs:
            paths: list[Any] = list(self._question.given) if given else [
                self._store.bag(number)]
            runs = list(self._given) if given and self._given else [
                load_run(path, namespace=self._question.namespace if given else None)
                for path in paths]
            for run, path in zip(runs, paths):
                run.path = self._store.as_seen(path)
            self._runs[number] = runs
        return self._runs[number]
