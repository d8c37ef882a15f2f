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

"""The file ``pam report`` writes to by itself: one that is free, or the page of the same bags."""

import os

from pam_actuation.report.page import text
from pam_sim.files import check_file, holds

LONGEST = 100


def marker(bags, page):
    """Return the words in a page that tell of which bags it is; ``page`` is its path."""
    folder = os.path.dirname(os.path.abspath(page))
    return 'report of ' + ' and '.join(os.path.relpath(bag, folder) for bag in bags)


def default_page(bags, overwrite=False):
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
    of = text(marker(bags, page)) + '">'       # as it stands in the head
    if os.path.lexists(page) and not overwrite and not holds(page, of):
        page = own
    check_file(page, overwrite, ours=of)
    return page
