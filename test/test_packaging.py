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

"""The package as others see it: manifest, versions, dependencies, installed files, pages."""

import ast
import fnmatch
import functools
from pathlib import Path
import re
import subprocess
import sys
import sysconfig
import tomllib  # noqa: I201

from catkin_pkg.changelog import get_changelog_from_path  # noqa: I100
from catkin_pkg.package import parse_package
import pam_actuation
from pam_actuation import resources
from pam_actuation.drivers.faults import fault_table_markdown
from pam_actuation.topics.table import RECORDED
from pam_sim.errors import InputError
import pytest
from rosbags.typesys import get_typestore, Stores
from source_trees import imports, parsed
import yaml

ROOT = Path(__file__).resolve().parent.parent
EXECUTABLES = (
    'valve_driver', 'plant_simulator', 'sofc_controller', 'pid_controller',
    'reference_generator', 'experiment_recorder', 'hardware_sensors', 'joint_simulator',
    'joint_controller', 'joint_trajectory_server', 'valve_watchdog')

# Import name -> name in setup.py, where they differ.
DISTRIBUTIONS = {'yaml': 'pyyaml', 'mcap_ros2': 'mcap-ros2-support',
                 'foxglove': 'foxglove-sdk',
                 'skfuzzy': 'scikit-fuzzy', 'sklearn': 'scikit-learn'}
# Import name -> rosdep key in package.xml; plotly has none (docs/guides/installation.md).
ROSDEP_KEYS = {
    'argcomplete': 'python3-argcomplete',
    'joblib': 'python3-joblib', 'lz4': 'mcap-ros2-support', 'mcap': 'mcap-ros2-support',
    'mcap_ros2': 'mcap-ros2-support',
    'matplotlib': 'python3-matplotlib', 'numba': 'python3-numba', 'numpy': 'python3-numpy',
    'pandas': 'python3-pandas',
    'rosbags': 'python3-rosbags-pip', 'scipy': 'python3-scipy',
    'tqdm': 'python3-tqdm', 'yaml': 'python3-yaml', 'zstandard': 'mcap-ros2-support',
    'plotly': None}
# Come with rclpy or are only tried, with a way out where they are missing.
WITH_ROS = {'rclpy', 'ament_index_python'}
# Only where a cluster is named (pam_actuation/workers says what to install), for kinds of
# tables, for the live page, for Foxglove.
OPTIONAL = {'dask', 'distributed', 'ray', 'foxglove', 'h5py', 'nptdms', 'openpyxl', 'pyarrow',
            'tornado'}


@pytest.fixture(scope='module')
def manifest():
    """Parse package.xml as colcon does; any warning fails."""
    warnings = []
    package = parse_package(str(ROOT), warnings=warnings)
    package.validate(warnings=warnings)
    assert warnings == []
    return package


@pytest.fixture(scope='module')
def setup_keywords():
    """Return what setup.py hands to setuptools, read without installing anything."""
    path, seen = ROOT / 'setup.py', {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        patch.setattr('setuptools.setup', seen.update)
        exec(compile(path.read_text(encoding='utf-8'), str(path), 'exec'),
             {'__file__': str(path), '__name__': '__main__'})
    return seen


@functools.cache
def imported_modules(folder):
    """Return {top-level module: files that import it} for all sources below a folder."""
    found = {}
    for path in sorted((ROOT / folder).rglob('*.py')):
        for node in imports(parsed(path)):
            names = [node.module] if isinstance(node, ast.ImportFrom) and node.level == 0 else []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            for name in names:
                found.setdefault(name.split('.')[0], set()).add(path)
    return {k: v for k, v in found.items() if k not in sys.stdlib_module_names}


def requirement_names(requirements):
    """Return the lower-case distribution names of requirement strings."""
    return {re.match(r'[A-Za-z0-9_.-]+', r)[0].lower() for r in requirements}


def test_manifest_is_an_ament_python_package(manifest):
    assert manifest.package_format == 3
    assert manifest.get_build_type() == 'ament_python'
    assert manifest.licenses == ['Apache-2.0']
    assert (ROOT / 'resource' / manifest.name).is_file()


def test_one_version_everywhere(manifest, setup_keywords):
    changelog = (ROOT / 'CHANGELOG.rst').read_text(encoding='utf-8')
    newest = re.search(r'^(\d+\.\d+\.\d+) \(\d{4}-\d{2}-\d{2}\)$', changelog, re.M)[1]
    assert {manifest.version, setup_keywords['version'], newest} == {pam_actuation.__version__}


def test_how_to_cite_says_what_the_manifest_says(manifest):
    cited = yaml.safe_load((ROOT / 'CITATION.cff').read_text(encoding='utf-8'))
    assert cited['title'] == manifest.name and cited['license'] == manifest.licenses[0]
    assert [one['name'] for one in cited['authors']] == [one.name for one in manifest.authors]
    assert 'version' not in cited       # it would be one more place that a release must change


def test_changelog_is_read_by_the_release_tool():
    changelog = get_changelog_from_path(str(ROOT), 'pam_actuation')
    versions = [version for version, date, content in changelog.foreach_version()]
    assert versions[-1] == pam_actuation.__version__       # the oldest comes first


def test_setup_agrees_with_the_manifest(manifest, setup_keywords):
    assert setup_keywords['name'] == manifest.name
    assert setup_keywords['license'] == manifest.licenses[0]
    assert setup_keywords['maintainer_email'] == manifest.maintainers[0].email


def test_executables_are_declared_and_importable_by_path(setup_keywords):
    scripts = dict(
        re.split(r'\s*=\s*', line) for line in setup_keywords['entry_points']['console_scripts'])
    assert {name: f'pam_actuation.nodes.executables:{name}' for name in EXECUTABLES} == {
        name: target for name, target in scripts.items() if name != 'pam'}
    for target in scripts.values():
        module, function = target.split(':')
        tree = ast.parse((ROOT / (module.replace('.', '/') + '.py')).read_text(encoding='utf-8'))
        assert function in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def test_every_source_folder_is_packaged(setup_keywords):
    folders = {
        '.'.join(path.parent.relative_to(ROOT).parts)
        for top in ('pam_actuation', 'pam_sim') for path in (ROOT / top).rglob('*.py')}
    assert folders == set(setup_keywords['packages'])


def test_every_data_file_of_the_packages_is_packaged(setup_keywords):
    for path in [*ROOT.glob('pam_actuation/**/*'), *ROOT.glob('pam_sim/**/*')]:
        if path.is_dir() or path.suffix in ('.py', '.pyc', '.nbi', '.nbc'):
            continue
        top, *rest = path.relative_to(ROOT).parts
        if '__pycache__' in rest:
            continue
        patterns = setup_keywords['package_data'].get(top, [])
        assert any(fnmatch.fnmatch('/'.join(rest), pattern) for pattern in patterns), path


def test_shared_files_are_installed(setup_keywords):
    installed = {
        f'{target}/{Path(file).name}'
        for target, files in setup_keywords['data_files'] for file in files}
    for folder in ('config', 'launch', 'msg_docs', 'docs/reference/nodes',
                   'docs/reference/files'):
        for path in (ROOT / folder).rglob('*'):
            if path.is_file() and '__pycache__' not in path.parts:
                assert f'share/pam_actuation/{path.relative_to(ROOT).as_posix()}' in installed
    assert 'share/ament_index/resource_index/packages/pam_actuation' in installed
    assert 'share/pam_actuation/package.xml' in installed


def test_every_import_is_declared(manifest, setup_keywords):
    modules = {**imported_modules('pam_sim'), **imported_modules('pam_actuation')}
    for own in ('pam_sim', 'pam_actuation', *OPTIONAL):
        modules.pop(own, None)
    pip_names = requirement_names(setup_keywords['install_requires'])
    keys = {depend.name for depend in manifest.exec_depends}
    ros = {name for name in modules if name in WITH_ROS or name in keys or name.endswith('_msgs')}
    for name in set(modules) - ros:
        assert DISTRIBUTIONS.get(name, name) in pip_names, (name, modules[name])
        assert name in ROSDEP_KEYS, (name, modules[name])
        assert ROSDEP_KEYS[name] is None or ROSDEP_KEYS[name] in keys, name
    for name in ros:
        assert name in keys, (name, modules[name])
    assert 'ros-jazzy-ament-index-python' in setup_keywords['extras_require']['ros']


def test_the_lower_bounds_are_versions_that_work(setup_keywords):
    """Found with every library at its lowest version; below these a traceback is what one sees."""
    lowest = dict(re.split('>=', one) for one in setup_keywords['install_requires'])
    # The messages of Jazzy came with 0.10.8, what opens sqlite3 bags here with 0.11.
    assert lowest['rosbags'] == '0.11.0' and hasattr(Stores, 'ROS2_JAZZY')
    assert lowest['numba'] == '0.58.1' and lowest['mcap'] == '1.1.1'
    assert setup_keywords['extras_require']['ray'][0].startswith('ray[client]')


def test_no_requirement_without_an_import(setup_keywords):
    modules = {**imported_modules('pam_sim'), **imported_modules('pam_actuation')}
    used = {DISTRIBUTIONS.get(name, name) for name in modules}
    assert requirement_names(setup_keywords['install_requires']) <= used


def test_ros_wheels_are_an_extra_only(setup_keywords):
    assert not [r for r in setup_keywords['install_requires'] if r.startswith('ros-')]
    assert all(r.startswith('ros-jazzy-') for r in setup_keywords['extras_require']['ros'])


def test_benchmarks_need_no_more_than_their_extra(setup_keywords, manifest):
    bench = requirement_names(setup_keywords['extras_require']['bench'])
    assert not bench & requirement_names(setup_keywords['install_requires'])
    page = (ROOT / 'docs' / 'dependencies.md').read_text(encoding='utf-8')
    assert all(f'| {name} |' in page for name in bench)
    own = {path.stem for path in (ROOT / 'benchmarks').glob('*.py')}
    own |= {path.stem for folder in ('hidden', 'control', 'tables', 'view')
            for path in (ROOT / 'test' / folder).glob('*.py')}
    own |= {'pam_sim', 'pam_actuation'}
    allowed = bench | requirement_names(setup_keywords['install_requires'])
    allowed |= requirement_names(setup_keywords['extras_require']['view'])
    used = {DISTRIBUTIONS.get(name, name) for name in set(imported_modules('benchmarks')) - own}
    # Those that start nodes need ROS as the nodes do.
    assert used - {depend.name for depend in manifest.exec_depends} <= allowed


def test_only_nodes_import_ros():
    package = ROOT / 'pam_actuation'
    # The session that starts the nodes has one node of its own, to talk to them.
    allowed = {*(package / 'nodes').rglob('*.py'), package / 'rigging' / 'client.py'}
    for name, paths in imported_modules('pam_actuation').items():
        if name == 'rclpy' or name.endswith('_msgs') or name.startswith('launch'):
            assert paths <= allowed, (name, paths - allowed)
    for name, paths in imported_modules('pam_sim').items():
        assert name not in ('rclpy', 'pam_actuation') and not name.endswith('_msgs'), paths


def test_pyproject_leaves_everything_to_setup_py():
    said = tomllib.loads((ROOT / 'pyproject.toml').read_text(encoding='utf-8'))
    assert set(said) == {'build-system', 'tool'} and set(said['tool']) == {'mypy', 'ruff'}


@pytest.mark.parametrize('topic', RECORDED)
def test_a_page_per_topic_states_its_type(topic):
    text = (ROOT / 'msg_docs' / f'{topic}.md').read_text(encoding='utf-8')
    assert re.search(r'^\| message type \| `(.+)` \|$', text, re.M)[1] == RECORDED[topic].type_name
    assert 'ros2 topic pub' in text and f' {RECORDED[topic].type_name} ' in text
    for heading in ('## Fields', '## Rules', '## Quality of service', '## Example'):
        assert heading in text


def test_the_index_of_pages_lists_every_topic_with_its_type():
    text = (ROOT / 'msg_docs' / 'README.md').read_text(encoding='utf-8')
    listed = dict(re.findall(r'^\| \[`(\w+)`\]\(\1\.md\) \| `([\w/]+)` \|', text, re.M))
    assert listed == {name: topic.type_name for name, topic in RECORDED.items()}


@pytest.mark.parametrize('topic', RECORDED)
def test_the_example_of_a_page_is_a_valid_message(topic):
    text = (ROOT / 'msg_docs' / f'{topic}.md').read_text(encoding='utf-8')
    example = yaml.safe_load(re.search(r'^  "(\{.*\})"$', text, re.M)[1])
    store = get_typestore(Stores.ROS2_JAZZY)

    def check(value, type_name):
        fields = dict(store.fielddefs[type_name][1])
        for key, item in value.items():
            assert key in fields, f'{type_name} has no field {key}'
            if isinstance(item, dict):
                check(item, fields[key][1])
            elif isinstance(item, list) and item and isinstance(item[0], dict):
                for entry in item:
                    check(entry, fields[key][1][0][1])

    check(example, RECORDED[topic].type_name)


def test_links_between_the_pages_lead_somewhere():
    pages = [*ROOT.glob('*.md'), *ROOT.glob('docs/**/*.md'), *ROOT.glob('msg_docs/*.md')]
    for page in pages:
        for target in re.findall(r'\]\(([^)#\s]+)[^)]*\)', page.read_text(encoding='utf-8')):
            if '://' not in target and not target.startswith('mailto:'):
                assert (page.parent / target).exists(), f'{page.name}: {target}'


def test_find_config_accepts_names_and_files(tmp_path):
    name = resources.list_config('experiments')[0]
    assert resources.find_config('experiments', name).is_file()
    own = tmp_path / 'own.yaml'
    own.write_text('name: own\n', encoding='utf-8')
    assert resources.find_config('experiments', own) == own


def test_find_config_lists_what_exists():
    with pytest.raises(InputError) as error:
        resources.find_config('experiments', 'xyz')
    assert 'xyz' in str(error.value)
    assert all(name in str(error.value) for name in resources.list_config('experiments'))
    with pytest.raises(InputError, match='no such file'):
        resources.find_config('experiments', 'missing/own.yaml')


def test_shared_files_are_found_below_an_installed_prefix(tmp_path, monkeypatch):
    site = tmp_path / 'lib' / 'python3.12' / 'site-packages' / 'pam_actuation'
    share = tmp_path / 'share' / 'pam_actuation'
    (share / 'config').mkdir(parents=True)
    (share / 'package.xml').write_text('<package/>', encoding='utf-8')
    site.mkdir(parents=True)
    monkeypatch.setattr(resources, '__file__', str(site / 'resources.py'))
    assert resources.share_dir() == share


def test_a_missing_installation_is_said_plainly(tmp_path, monkeypatch):
    monkeypatch.setattr(resources, '__file__', str(tmp_path / 'pam_actuation' / 'resources.py'))
    monkeypatch.delenv('AMENT_PREFIX_PATH', raising=False)
    with pytest.raises(InputError, match='not installed'):
        resources.share_dir()


def test_this_python_is_supported(setup_keywords):
    version = sysconfig.get_python_version()
    assert version in ('3.11', '3.12')
    assert setup_keywords['python_requires'] == '>=3.11,<3.13'


def test_the_printed_fault_table_is_the_one_the_driver_uses():
    text = (ROOT / 'docs' / 'reference' / 'faults.md').read_text(encoding='utf-8')
    printed = re.search(
        r'<!-- fault table: begin -->\n(.*)<!-- fault table: end -->', text, re.S)[1]
    assert printed == fault_table_markdown(), 'copy what fault_table_markdown() returns'


def test_the_architecture_page_names_what_exists():
    text = (ROOT / 'docs' / 'architecture.md').read_text(encoding='utf-8')
    tree = re.search(r'```\n(pam_sim/\n.*?)```', text, re.S)[1]
    folders = []
    for line in tree.splitlines():
        depth = (len(line) - len(line.lstrip())) // 2
        name = line.split()[0]
        path = ROOT.joinpath(*folders[:depth], name)
        assert path.is_dir() if name.endswith('/') else path.is_file(), path
        folders[depth:] = [name]
    for path in re.findall(r'`((?:pam_sim|pam_actuation)/[\w/.]+)`', text):
        assert (ROOT / path).exists(), path
    beside = [f'{path.name}/' if path.is_dir() else path.name
              for package in ('pam_sim', 'pam_actuation') for path in (ROOT / package).iterdir()
              if not path.name.startswith('_') and (path.is_dir() or path.suffix == '.py')]
    assert [name for name in beside if not re.search(rf'\b{re.escape(name)}', tree)] == []


def test_the_workflow_runs_every_step_of_the_script_for_jazzy():
    jobs = yaml.safe_load((ROOT / '.github' / 'workflows' / 'tests.yml').read_text())['jobs']
    run = [step['run'] for job in jobs.values() for step in job['steps'] if 'run' in step]
    script = ROOT / '.ci' / 'jazzy'
    assert subprocess.run(['bash', '-n', str(script)]).returncode == 0
    usage = subprocess.run([str(script)], capture_output=True, text=True)
    steps = re.findall(r'^  (\w+) +\S', usage.stdout, re.MULTILINE)
    assert usage.returncode == 2 and len(steps) == 5
    assert sorted(run) == sorted(['.ci/run', *(f'.ci/jazzy {step}' for step in steps)])
