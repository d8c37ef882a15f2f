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

"""Installs pam_actuation and pam_sim, with colcon as a ROS 2 package or with pip alone."""

from pathlib import Path

from setuptools import find_packages, setup

PACKAGE = 'pam_actuation'
VERSION = '1.0.0'
HERE = Path(__file__).parent

# Read or shown at run time; found again by pam_actuation/resources.py.
SHARED_FOLDERS = ('config', 'launch', 'msg_docs', 'docs/reference/nodes', 'docs/reference/files')

# Everything but the live nodes works with these alone. The lower bounds are
# the versions of Ubuntu 24.04, the platform of ROS 2 Jazzy, where it has them.
RUN_REQUIRES = [
    'numpy>=1.26',
    'scipy>=1.11',
    'numba>=0.58.1',     # the first one for numpy 1.26
    'PyYAML>=6.0',
    'mcap>=1.1.1',       # 1.1.0 reads no file without chunks
    'mcap-ros2-support>=0.5',
    'lz4>=4.3',
    'zstandard>=0.22',
    'pandas>=2.1',
    'rosbags>=0.11.0',   # messages of Jazzy from 0.10.8 on, sqlite3 bags from here on
    'plotly>=5.15',
    'matplotlib>=3.6',
    'joblib>=1.3',
    'tqdm>=4.66',
    'argcomplete>=3.1',
]

# An extra, never a requirement: where ROS 2 is installed these would shadow it.
ROS_REQUIRES = [
    'ros-jazzy-rclpy',
    'ros-jazzy-ament-index-python',
    'ros-jazzy-common-interfaces',
    'ros-jazzy-lifecycle-msgs',
    'ros-jazzy-rmw-fastrtps-cpp',
]

# `make docs`; see docs/dependencies.md.
DOCS_REQUIRES = [
    'sphinx>=7.2',
    'docutils>=0.21',    # formulas as MathML, with the arguments used
    'myst-parser>=2.0',
    'furo>=2024.1',
    'myst-nb>=1.1',      # tutorials that are notebooks; brings nbclient and ipykernel
]

# `pam view`: the page in the browser. Loaded by this verb only.
VIEW_REQUIRES = [
    'tornado>=6.4',
]

# `pam view --foxglove`. Loaded by this option only.
FOXGLOVE_REQUIRES = [
    'foxglove-sdk>=0.16',
]

# Tables of `pam import` and `pam export` that pandas reads with another library.
TABLE_REQUIRES = [
    'pyarrow>=14.0',     # Parquet
    'h5py>=3.10',        # HDF5, and MAT files of version 7.3
    'openpyxl>=3.1',     # Excel
    'npTDMS>=1.7',       # TDMS of LabVIEW
]

TEST_REQUIRES = [
    *DOCS_REQUIRES,
    *TABLE_REQUIRES,
    *VIEW_REQUIRES,
    *FOXGLOVE_REQUIRES,
    'pytest>=7.4',
    'pytest-timeout>=2.1',
    'pytest-xdist>=3.7',
    'hypothesis>=6.98',
    'jsonschema>=4.10',
    'sybil>=6.0',
    'catkin_pkg>=1.0',
    'colcon-common-extensions>=0.3',
    # The rules of ament_flake8 and ament_pep257, as far as each has them.
    'ruff>=0.12',
    'pycodestyle>=2.11',
    'flake8-import-order>=0.18.2',
    'mypy>=1.15',
    'types-PyYAML>=6.0',
    'distributed>=2022.12',
    'setuptools>=70.1',  # builds a wheel by itself; colcon sets the upper bound
]

# To run with `--cluster` on a Dask scheduler that exists already.
CLUSTER_REQUIRES = [
    'distributed>=2022.12',
]

# The same on a Ray cluster; `ray` alone cannot speak to one (ray://).
RAY_REQUIRES = [
    'ray[client]>=2.9',
]

# Only to compare with; nothing in the package imports it.
BENCH_REQUIRES = [
    'mujoco>=3.2',
    'scikit-fuzzy>=0.5',
    'networkx>=3.2',  # scikit-fuzzy needs it and does not bring it
    'pysindy>=2.0',
    'scikit-learn>=1.4',
    'cloudpickle>=2.0',
]


def shared_files():
    """Return (target folder, files) pairs that put SHARED_FOLDERS below share/pam_actuation."""
    pairs = []
    for name in SHARED_FOLDERS:
        for folder in [HERE / name, *sorted((HERE / name).rglob('*'))]:
            if not folder.is_dir() or folder.name == '__pycache__':
                continue
            files = sorted(str(p.relative_to(HERE)) for p in folder.iterdir() if p.is_file())
            if files:
                pairs.append((f'share/{PACKAGE}/{folder.relative_to(HERE).as_posix()}', files))
    return pairs


setup(
    name=PACKAGE,
    version=VERSION,
    packages=find_packages(include=['pam_actuation*', 'pam_sim*']),
    package_data={'pam_actuation': [
        'py.typed', 'view/page/*', 'investigate/*.schema.json'], 'pam_sim': [
        'py.typed', 'presets/*.yaml', 'muscle/*.csv', 'muscle/sizes/*.yaml',
        'muscle/lookup_tables/*', 'joint/presets/*.yaml', 'valve/regulators/*.yaml',
        'gap/*.schema.json', 'identify/*.schema.json']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{PACKAGE}']),
        (f'share/{PACKAGE}', ['package.xml']),
        *shared_files(),
    ],
    python_requires='>=3.11,<3.13',
    install_requires=RUN_REQUIRES,
    extras_require={
        'ros': ROS_REQUIRES, 'test': TEST_REQUIRES, 'docs': DOCS_REQUIRES,
        'tables': TABLE_REQUIRES, 'view': VIEW_REQUIRES,
        'foxglove': FOXGLOVE_REQUIRES,
        'cluster': CLUSTER_REQUIRES, 'ray': RAY_REQUIRES, 'bench': BENCH_REQUIRES},
    zip_safe=False,
    maintainer='pam_actuation developers',
    maintainer_email='pam_actuation@example.org',
    description='Control, simulation and model correction of pneumatic artificial muscles',
    long_description=(HERE / 'README.md').read_text(encoding='utf-8')
    if (HERE / 'README.md').exists() else '',
    long_description_content_type='text/markdown',
    license='Apache-2.0',
    entry_points={
        'console_scripts': [
            'valve_driver = pam_actuation.nodes.executables:valve_driver',
            'valve_watchdog = pam_actuation.nodes.executables:valve_watchdog',
            'plant_simulator = pam_actuation.nodes.executables:plant_simulator',
            'sofc_controller = pam_actuation.nodes.executables:sofc_controller',
            'pid_controller = pam_actuation.nodes.executables:pid_controller',
            'joint_simulator = pam_actuation.nodes.executables:joint_simulator',
            'joint_controller = pam_actuation.nodes.executables:joint_controller',
            'joint_trajectory_server = pam_actuation.nodes.executables:joint_trajectory_server',
            'reference_generator = pam_actuation.nodes.executables:reference_generator',
            'hardware_sensors = pam_actuation.nodes.executables:hardware_sensors',
            'experiment_recorder = pam_actuation.nodes.executables:experiment_recorder',
            'pam = pam_actuation.cli.main:main',
        ],
    },
)
