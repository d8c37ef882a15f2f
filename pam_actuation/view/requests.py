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

"""What a page may ask for: checked, so that nothing else goes further."""

from dataclasses import dataclass
import json
import math

from pam_actuation.view.stream import WINDOWS_S
from pam_sim.errors import InputError

WATCH, EMERGENCY_STOP, RESET, MARK = 'watch', 'emergency_stop', 'reset', 'mark'
ACTIONS = (EMERGENCY_STOP, RESET)       # of drivers, by the names of their services
PLAY, HALT = 'play', 'halt'
ALL = (WATCH, *ACTIONS, PLAY, HALT, MARK)
LONGEST = 4096          # bytes of a request
LONGEST_MARKER = 80     # characters


@dataclass(frozen=True)
class Request:
    """
    One request of a page.

    Parameters
    ----------
    do : str
        ``WATCH``: show another window; one of ``ACTIONS``; ``PLAY`` or ``HALT`` an experiment;
        set a marker: ``MARK``.
    number : int
        By which the page finds the answer.
    view : str
        Namespace to show, or of the rigs it is for; '' for all. An emergency stop is for all.
    window_s : float
        Time across the page [s].
    end_s : float, optional
        Of a bag: end of the window, from the begin of the bag on [s].
    experiment : str
        What is to be played.
    text : str
        Of a marker.

    """

    do: str
    number: int = 0
    view: str = ''
    window_s: float = 10.0
    end_s: float | None = None
    experiment: str = ''
    text: str = ''


def parse(text: str | bytes) -> Request:
    """
    Return the request in a message of a page.

    Raises
    ------
    InputError
        It is none.

    """
    try:
        found = json.loads(text)
    except ValueError:
        raise InputError('is not JSON', 'request') from None
    if not isinstance(found, dict):
        raise InputError('is not a JSON object', 'request')
    do = found.get('do')
    if do not in ALL:
        raise InputError(f'do is {do!r}; allowed are {", ".join(ALL)}', 'request')
    number = found.get('number', 0)
    if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number < 2**53:
        raise InputError('number is not a whole number from 0 on', 'request')
    if do == EMERGENCY_STOP:
        return Request(do, number)      # for all drivers, whatever else is in it
    # A reset lets pressure in, so it must say where.
    view = found.get('view', None if do == RESET else '')
    experiment = found.get('experiment', '')
    if not isinstance(view, str):
        raise InputError('view is not a text', 'request')
    if do == RESET:
        return Request(do, number, view)
    if do in (PLAY, HALT):
        if not isinstance(experiment, str) or (do == PLAY) != bool(experiment):
            raise InputError('experiment is needed to play, and only there', 'request')
        return Request(do, number, view, experiment=experiment)
    if do == MARK:
        return Request(do, number, view, text=_marker_text(found.get('text')))
    window_s, end_s = found.get('window_s', 10), found.get('end_s')
    if window_s not in WINDOWS_S:
        raise InputError(
            f'window_s is {window_s!r}; allowed are {", ".join(map(str, WINDOWS_S))}', 'request')
    if end_s is not None and not (
            isinstance(end_s, (int, float)) and math.isfinite(end_s) and abs(end_s) < 1e9):
        raise InputError(f'end_s is {end_s!r}; allowed is a time in s', 'request')
    return Request(do, number, view, float(window_s), None if end_s is None else float(end_s))


def _marker_text(given: object) -> str:
    """Return the text of a marker without spaces around it; InputError."""
    text = given.strip() if isinstance(given, str) else ''
    if not (0 < len(text) <= LONGEST_MARKER and text.isprintable()):
        raise InputError(f'text is {given!r}; a marker has 1 to {LONGEST_MARKER} characters on '
                         'one line', 'request')
    return text
