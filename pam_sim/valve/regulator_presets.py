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
Regulators by name: the numbers of their data sheets.

Each is a YAML file in ``pam_sim/valve/regulators``; being there is being known. What a data
sheet does not state is left out of the file, and then has to be stated with the rig.
"""

from dataclasses import dataclass

from pam_sim.errors import did_you_mean, InputError
from pam_sim.keys import Key, names_of
from pam_sim.named_files import NamedFiles

_FILES = NamedFiles('valve/regulators')
KEYS = (
    Key('sold_as', str, 'Maker and type.', required=True),
    Key('lowest_gauge_pa', float, 'Gauge pressure at the lowest input.', required=True,
        unit='Pa', lower=-100e3, upper=200e3),
    Key('highest_gauge_pa', float, 'Gauge pressure at the highest input.', required=True,
        unit='Pa', lower=10e3, upper=2e6),
    Key('lowest_v', float, 'Lowest input.', otherwise='not stated', unit='V', lower=-1.0,
        upper=4.0),
    Key('highest_v', float, 'Highest input.', otherwise='not stated', unit='V', lower=4.5,
        upper=12.0),
    Key('lag_s', float, 'Time constant.', otherwise='not stated', unit='s', lower=0.001,
        upper=2.0),
    Key('rests_on', str, 'Where the numbers come from.', required=True),
)


@dataclass(frozen=True)
class RegulatorPreset:
    """
    What a data sheet says of a regulator; None where it says nothing.

    Parameters
    ----------
    name, sold_as : str
        Name of the file; maker and type.
    lowest_gauge_pa, highest_gauge_pa : float
        Range of the pressure, Pa gauge.
    rests_on : str
        Source of the numbers.
    lowest_v, highest_v, lag_s : float or None
        Range of the input [V], time constant [s].

    """

    name: str
    sold_as: str
    lowest_gauge_pa: float
    highest_gauge_pa: float
    rests_on: str
    lowest_v: float | None = None
    highest_v: float | None = None
    lag_s: float | None = None


def regulator_names() -> list[str]:
    """Return the names of the regulators there are, sorted."""
    return _FILES.names()


def get_regulator(name: str) -> RegulatorPreset:
    """
    Return a regulator by name.

    Raises
    ------
    InputError
        Unknown name, or a file with a wrong key or number.

    """
    names = regulator_names()
    if name not in names:
        raise InputError(f'regulator `{name}` is not known{did_you_mean(name, names)}; allowed: '
                         f'{", ".join(names)}; for another one state '
                         '--regulator-volts and --regulator-kpa in its place')
    data = _FILES.read(name).check_keys(names_of(KEYS))
    values = {key.name: key.read(data) for key in KEYS}
    return RegulatorPreset(name, **{**values, 'rests_on': ' '.join(values['rests_on'].split())})
