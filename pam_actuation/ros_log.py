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

"""Where ROS writes its log files if the environment names no home folder."""

import os
import pwd
import tempfile


def name_log_folder() -> None:
    """
    Set ``ROS_LOG_DIR`` where ROS would find no folder, as in a service of systemd.

    It is the usual one in the home folder that the system knows of the user, else in that for
    temporary files.
    """
    if not any(os.environ.get(name) for name in ('HOME', 'ROS_HOME', 'ROS_LOG_DIR')):
        try:
            home = pwd.getpwuid(os.getuid()).pw_dir
        except KeyError:
            home = tempfile.gettempdir()
        os.environ['ROS_LOG_DIR'] = os.path.join(home, '.ros', 'log')
