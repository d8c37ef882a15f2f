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

"""Run a script with the compiler on and off, for tests that want equal bits."""

import os
import subprocess
import sys
from unittest import mock

from numba import config
import numpy as np


def compiled_and_not(script, folder):
    """
    Return the arrays a script saves to its first argument, [compiled, not compiled].

    The compiler is switched at import: the second run has a process of its own.
    """
    assert not config.DISABLE_JIT, 'NUMBA_DISABLE_JIT is set: nothing is compiled'
    compiled, interpreted = str(folder / 'compiled.npy'), str(folder / 'interpreted.npy')
    with mock.patch('sys.argv', ['-c', compiled]):
        exec(compile(script, 'script', 'exec'), {'__name__': '__main__'})
    subprocess.run([sys.executable, '-c', script, interpreted], check=True,
                   env={**os.environ, 'NUMBA_DISABLE_JIT': '1',
                        'PYTHONPATH': os.pathsep.join(sys.path)})
    return [np.load(compiled), np.load(interpreted)]
