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

"""The one error a user's mistake raises, anywhere in the two packages, and its hints."""

from collections.abc import Iterable
import difflib
import os


class InputError(ValueError):
    """
    A mistake in something the user gave: file, option, parameter, message.

    The command line prints the text as one sentence and exits with code 2; a
    node logs it. It is never used for a fault of the program itself.

    Parameters
    ----------
    problem : str
        What is wrong, with the offending value and what is allowed.
    where : str or path, optional
        Place of the mistake: ``file:line``, parameter name or topic.

    """

    def __init__(self, problem: str, where: str | os.PathLike[str] = '') -> None:
        self.problem = problem
        self.where = os.fspath(where)
        super().__init__(f'{where}: {problem}' if where else problem)


def did_you_mean(
        name: object, known: Iterable[object], quote: str = '`',
        inside: str = ' (did you mean {}?)') -> str:
    """
    Return a hint at the known name that a wrong one is nearest to, empty without any.

    Capitals count for nothing, nor does ``-`` instead of ``_``. A name of which the wrong one is
    the first word or words is nearest. Without a similar name the first one that begins with the
    wrong one, or holds it, is near.

    Parameters
    ----------
    name : str
        What the user wrote.
    known : iterable of str
        What would have been right.
    quote : str
        Put about the name in the hint.
    inside : str
        The hint, with ``{}`` for the name.

    """
    spellings = [str(one) for one in known]
    plain = _plain(name)
    if not plain:
        return ''
    spelled: dict[str, str] = {}
    for one in spellings:
        spelled.setdefault(_plain(one), one)
    near = [one for one in spelled if one.startswith(f'{plain}_')] \
        or difflib.get_close_matches(plain, spelled, n=1) \
        or [one for one in spelled if len(plain) > 1 and one.startswith(plain)] \
        or [one for one in spelled if len(plain) > 2 and plain in one]
    return inside.format(f'{quote}{spelled[near[0]]}{quote}') if near else ''


def _plain(name: object) -> str:
    return str(name).strip().lower().replace('-', '_')
