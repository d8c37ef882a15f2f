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

"""Ask `pam gap` about a recorded case, as a person would on the command line."""

import contextlib
import io
import json


def pam_gap(folder, runs, out, materiality=1.0, seconds=None):
    """
    Return the data of the ``gap.json`` that `pam gap` wrote; of a crash, its reason.

    Parameters
    ----------
    folder : pathlib.Path
        A case: ``model.yaml`` and the bag ``certify``.
    runs : list of pathlib.Path
        Bags to learn from.
    out : pathlib.Path
        Folder for the results.
    materiality, seconds : float
        As of the options.

    """
    options = ['--certify', str(folder / 'certify'), '--materiality', str(materiality)]
    return ask(runs, folder / 'model.yaml', options, out, seconds)


def ask(runs, model, options, out, seconds=None):
    """Return as ``pam_gap`` the answer about bags, a model, and further options of the verb."""
    from pam_actuation.cli.main import main
    said = io.StringIO()
    arguments = ['gap', *map(str, runs), '--model', str(model), *options, '--out', str(out)]
    arguments += [] if seconds is None else ['--seconds', str(seconds)]
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            main(arguments)
        return json.loads((out / 'gap.json').read_text(encoding='utf-8'))
    except (Exception, SystemExit) as error:      # a crash is an answer, too: a wrong one
        return {'verdict': 'crashed', 'reason': f'{error!r} {said.getvalue()[-2000:]}'}
