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
Finds the files that come with the package: config, launch, msg_docs and pages of the nodes.

There are three possible places. In a source tree (also an editable or symlinked installation) they
are beside the package. Installed by pip or colcon, merged or not, they are in
``share/pam_actuation`` below the prefix. Otherwise they are in the share folder that the ament
index names. No ROS is needed for the first two.
"""

from collections.abc import Iterator
from pathlib import Path

from pam_sim.errors import did_you_mean, InputError

PACKAGE = 'pam_actuation'


def share_dir() -> Path:
    """
    Return the folder that holds config, launch and msg_docs.

    Raises
    ------
    InputError
        When the installation is incomplete; names the folders looked at.

    """
    tried = []
    for candidate in _candidates():
        if (candidate / 'package.xml').is_file() and (candidate / 'config').is_dir():
            return candidate
        tried.append(str(candidate))
    raise InputError(
        f'the files of {PACKAGE} (config, launch) are not installed; looked in '
        f'{", ".join(tried)}; install the package again')


def config_dir() -> Path:
    """Return the folder of configuration files, one sub-folder per kind."""
    return share_dir() / 'config'


def node_page(name: str) -> Path:
    """
    Return the page of a node, made from the code.

    Raises
    ------
    InputError
        It is not installed.

    """
    path = share_dir() / 'docs' / 'reference' / 'nodes' / f'{name}.md'
    if not path.is_file():
        raise InputError('the page of this node is not installed; install the package again',
                         str(path))
    return path


def list_config(kind: str) -> list[str]:
    """Return the sorted names (without .yaml) of the configurations of one kind."""
    return sorted(path.stem for path in (config_dir() / kind).glob('*.yaml'))


def find_config(kind: str, name: Path | str) -> Path:
    """
    Return the configuration file that a user means.

    Parameters
    ----------
    kind : str
        Sub-folder of config: ``experiments``, ``controllers``.
    name : str or Path
        A name from :func:`list_config`, or the path of a file of the user's
        own (anything with a folder in it or ending in .yaml or .yml).

    Returns
    -------
    Path
        An existing file.

    Raises
    ------
    InputError
        When there is none; lists the names that exist.

    """
    text = str(name)
    own = Path(text).expanduser()
    if own.suffix in ('.yaml', '.yml') or len(own.parts) > 1:
        if own.is_file():
            return own
        raise InputError('there is no such file', where=text)
    path = config_dir() / kind / f'{text}.yaml'
    if path.is_file():
        return path
    known = list_config(kind)
    raise InputError(
        f'there is no such entry in config/{kind}{did_you_mean(text, known)}; there are: '
        f'{", ".join(known) or "none"}; '
        'a file of your own is given with its .yaml ending', where=text)


def _candidates() -> Iterator[Path]:
    """Yield the folders that may hold the shared files, the nearest first."""
    package = Path(__file__).resolve().parent
    yield package.parent
    # <prefix>/lib/python3.x/site-packages/pam_actuation, or one level more or less.
    for prefix in package.parents:
        if (prefix / 'share' / PACKAGE).is_dir():
            yield prefix / 'share' / PACKAGE
    try:
        from ament_index_python.packages import get_package_share_directory
        yield Path(get_package_share_directory(PACKAGE))
    except (ImportError, LookupError, OSError):
        return  # no ROS 2 environment: the folders above are all there are
