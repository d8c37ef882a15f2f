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
Makes the picture of the README: a report of `pam gap`, as a browser shows it.

``python docs/generate/report_picture.py`` runs the worked example of docs/explanation/gap.md and
photographs three parts of its report: the answer, the evidence against each rival, and contraction
and force. It needs Chromium (Debian: ``apt install chromium``).
"""

import io
from pathlib import Path
import shutil
import subprocess
import sys
import tempfile

DOCS = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(DOCS))

from generate.gap_figures import example  # noqa: E402
from pam_sim.errors import InputError  # noqa: E402
from PIL import Image  # noqa: E402

PICTURE = DOCS / 'figures' / 'report.png'
SIZE = 1560, 975                # of the window, pixels
COLOURS = 64
KEPT = 'What is missing in the model', 'Evidence against each rival'
# Where contraction begins in the figure of the free run, below the pressure [pixels].
BELOW_PRESSURE = 408
# The kept headings go left with what follows them, the figure goes right.
ARRANGE = """
<style>
 main, header.top { max-width: none; } nav, #provenance { display: none; }
 #gap { display: grid; grid-template-columns: 800px 1fr; gap: 0 24px; }
 #gap > .right { overflow: hidden; height: 850px; }
 #gap > .right figure { margin-top: -OFFSETpx; }
</style>
<script>
 const section = document.getElementById('gap'), kept = KEPT;
 const left = document.createElement('div'), right = document.createElement('div');
 right.className = 'right';
 let heading = '';
 for (const one of [...section.children]) {
   if (one.tagName === 'H3') heading = one.textContent;
   if (one.tagName === 'FIGURE' && one.querySelector('[style*="1252px"]')) right.append(one);
   else if (one.tagName !== 'FIGURE' && (!heading || kept.includes(heading))) left.append(one);
   else one.remove();
 }
 section.append(left, right);
 dispatchEvent(new Event('resize'));
</script>
"""
FLAGS = ('--headless', '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run',
         '--disable-background-networking', '--disable-component-update', '--disable-sync',
         '--hide-scrollbars', '--virtual-time-budget=8000')


def arranged(report: str) -> str:
    """
    Return a report with its kept parts beside each other.

    Parameters
    ----------
    report : str
        HTML of a report of ``pam gap``.

    Returns
    -------
    str

    Raises
    ------
    InputError
        A part is not in the report.

    """
    for part in (*(f'<h3>{heading}</h3>' for heading in KEPT), 'min-height:1252px'):
        if part not in report:
            raise InputError(f'has no {part}', 'the report')
    arrange = ARRANGE.replace('OFFSET', str(BELOW_PRESSURE)).replace('KEPT', str(list(KEPT)))
    return report.replace('</body>', f'{arrange}</body>')


def photograph(page: Path, target: Path) -> None:
    """
    Write what a browser shows of a page as a PNG of few colours.

    Parameters
    ----------
    page : Path
        HTML file.
    target : Path
        The picture.

    Raises
    ------
    InputError
        Chromium is missing.

    """
    browser = shutil.which('chromium')
    if browser is None:
        raise InputError('is missing; on Debian: apt install chromium', 'chromium')
    with tempfile.TemporaryDirectory() as folder:
        shot = Path(folder) / 'shot.png'
        subprocess.run(
            [browser, *FLAGS, f'--user-data-dir={folder}/profile', f'--screenshot={shot}',
             f'--window-size={SIZE[0]},{SIZE[1]}', page.as_uri()],
            check=True, capture_output=True, timeout=300.0)
        picture = Image.open(shot).convert('RGB').quantize(COLOURS, dither=Image.Dither.NONE)
        data = io.BytesIO()
        picture.save(data, 'PNG', optimize=True)
    target.write_bytes(data.getvalue())


if __name__ == '__main__':
    with tempfile.TemporaryDirectory() as place:
        example(Path(place))
        report = Path(place) / 'gap' / 'report.html'
        report.write_text(arranged(report.read_text(encoding='utf-8')), encoding='utf-8')
        photograph(report, PICTURE)
    print(f'{PICTURE}: {PICTURE.stat().st_size / 1e3:.0f} kB')
