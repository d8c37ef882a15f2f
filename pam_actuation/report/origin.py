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
Of what a page is: words in its head, by which results of the same bags are made again.

Whatever else is there already is replaced only when the user says so.
"""

import os

from pam_actuation.report.page import text
from pam_sim.files import check_file, holds

LONGEST = 100


def origin(bags: list[str], page: str, kind: str = 'report', model: str = '',
           certify: str | None = None) -> str:
    """
    Return the words in the head of a page that tell of what it is.

    Parameters
    ----------
    bags : list of path
        The recordings on it.
    page : path
        The file; paths are told as seen from its folder, which may move with them.
    kind : str
        ``report`` or ``gap``.
    model : str
        Preset or path of the model held against them.
    certify : path, optional
        The recording of the proof.

    """
    folder = os.path.dirname(os.path.abspath(page))

    def seen(path: str) -> str:
        return os.path.relpath(path, folder) if os.path.exists(path) else str(path)

    words = [f'{kind} of ' + ' and '.join(map(seen, bags))]
    words += [f'model {seen(model)}'] if model else []
    words += [f'certify {seen(certify)}'] if certify else []
    return ', '.join(words)


def is_of(page: str, words: str) -> bool:
    """Return whether a page is there and its head tells these words of ``origin``."""
    return holds(page, _as_written(words))


def _as_written(words: str) -> str:
    return f'{text(words)}">'


def default_page(bags: list[str], overwrite: bool = False) -> str:
    """
    Return the path of the page about some bags.

    ``report.html`` beside the first bag, or ``report_BAG.html`` where that is another page.

    Raises
    ------
    InputError
        Both are other pages, or nothing can be written there.

    """
    first = os.path.abspath(bags[0])
    folder = os.path.dirname(first)
    names = [os.path.splitext(os.path.basename(os.path.abspath(bag)))[0] for bag in bags]
    own = os.path.join(folder, f'report_{"_".join(names)[:LONGEST]}.html')
    page = os.path.join(folder, 'report.html')
    of = origin(bags, page)
    if os.path.lexists(page) and not overwrite and not is_of(page, of):
        page = own
    check_file(page, overwrite, ours=_as_written(of))
    return page
