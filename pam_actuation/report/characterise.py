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
Write what ``pam characterise`` found: table, numbers, the chapter's figures, a page.

``lookup.csv``, ``holds.csv``, ``characterise.json``, ``figure_4_2.svg``, ``figure_4_6.svg``,
``figure_4_7.svg`` and ``report.html``, each written whole or not at all.
"""

import base64
from collections.abc import Mapping
import csv
import io
import json
from pathlib import Path
from typing import Any, TYPE_CHECKING

import numpy as np

from pam_actuation.report import figures, svg
from pam_actuation.report.page import paragraph, plot, render, Section, table
from pam_actuation.report.pages import FOOTER
from pam_sim.files import StrPath, whole_files, write_text

if TYPE_CHECKING:
    from numpy.typing import ArrayLike
    from pam_sim.characterise.characterise import Characterisation
    from pam_sim.characterise.holds import Hold
    from pam_sim.characterise.surfaces import Surfaces

ISOBARS = 6                 # pressures in the figure of force against contraction
HOLD_COLUMNS = ('load_n', 'load_u_n', 'branch', 'pressure_gauge_pa', 'pressure_u_pa',
                'contraction_m', 'contraction_u_m', 'drift_m')


def force_figure(surfaces: 'Surfaces') -> str:
    """Return Figure 4.2 as SVG: force against % contraction, one curve per pressure."""
    law = surfaces.law()
    top = surfaces.pressure_gauge_pa[-1]
    chosen = sorted({int(np.argmin(np.abs(surfaces.pressure_gauge_pa - top * k / ISOBARS)))
                     for k in range(1, ISOBARS + 1)})
    curves = []
    for i in chosen:
        strain = np.linspace(surfaces.strain[i, -1], surfaces.strain[i, 0], 121)
        if strain[-1] <= 0.0:
            continue
        force = law.force_n(surfaces.pressure_gauge_pa[i], strain, outside='allow')
        lifted = surfaces.strain[i] > 0.0
        points = np.column_stack([
            100.0 * surfaces.strain[i], surfaces.load_n, 200.0 * surfaces.strain_u[i]])[lifted]
        curves.append(svg.Curve(f'{1e-3 * surfaces.pressure_gauge_pa[i]:.0f} kPa',
                                100.0 * strain, force, points))
    return svg.line_chart(curves, 'contraction [%]', 'force [N]',
                          'Force against contraction for several pressures')


def pressure_figure(surfaces: 'Surfaces') -> str | None:
    """Return Figure 4.6 as SVG: pressure over loading and mass of air; None without a mass."""
    if surfaces.air_mass_kg is None:
        return None
    load, pressure = np.meshgrid(surfaces.load_n, 1e-3 * surfaces.pressure_gauge_pa)
    return svg.surface_chart(
        load, 1e6 * surfaces.air_mass_kg, pressure,
        ('loading [N]', 'mass of air [mg]', 'pressure [kPa gauge]'),
        'Pressure over loading and mass of air')


def contraction_figure(surfaces: 'Surfaces') -> str:
    """Return Figure 4.7 as SVG: % contraction over pressure and loading."""
    load, pressure = np.meshgrid(surfaces.load_n, 1e-3 * surfaces.pressure_gauge_pa)
    return svg.surface_chart(
        load, pressure, 100.0 * surfaces.strain,
        ('loading [N]', 'pressure [kPa gauge]', 'contraction [%]'),
        'Contraction over pressure and loading', turn_deg=-38.0)


FIGURES = {'figure_4_2': force_figure, 'figure_4_6': pressure_figure,
           'figure_4_7': contraction_figure}
CAPTIONS = {
    'figure_4_2': 'Force against contraction (Figure 4.2 of the chapter). Dots are grid points '
                  'of the table, bars two standard uncertainties.',
    'figure_4_6': 'Pressure over loading and mass of air (Figure 4.6).',
    'figure_4_7': 'Contraction over pressure and loading (Figure 4.7).'}


FILES = ('characterise.json', 'report.html', 'holds.csv', 'lookup.csv',
         *(f'{name}.svg' for name in FIGURES))


def save_characterisation(result: 'Characterisation', out_dir: StrPath) -> dict[str, str]:
    """
    Write the folder of a result; return {name: path} of what was written.

    Raises
    ------
    InputError
        ``out_dir`` is a file or cannot be written.

    """
    out = Path(out_dir)
    pictures = {name: text for name, draw in FIGURES.items()
                if (text := draw(result.surfaces)) is not None}
    texts = {'characterise.json': json.dumps(document(result), allow_nan=False) + '\n',
             'report.html': _page(result, pictures)}
    texts.update({f'{name}.svg': text for name, text in pictures.items()})
    if result.loads:
        texts['holds.csv'] = holds_csv(result)
    with whole_files(out, FILES) as folder:
        for name, text in texts.items():
            write_text(folder / name, text)
        if result.surfaces.air_mass_kg is not None:
            result.table().write_csv(folder / 'lookup.csv')
        return {path.name: str(out / path.name) for path in folder.iterdir()}


def summary(result: 'Characterisation') -> dict[str, Any]:
    """Return the short result for programs, plain data."""
    surfaces = result.surfaces
    half = surfaces.half_distance[np.isfinite(surfaces.half_distance)]
    truth = {key: value for key, value in (result.truth or {}).items()
             if key != 'error_percent'} or None
    return {
        'kind': result.kind, 'derived': result.derived,
        'pressures': int(surfaces.pressure_gauge_pa.size),
        'pressure_range_kpa': [1e-3 * float(surfaces.pressure_gauge_pa[k]) for k in (0, -1)],
        'loads_n': surfaces.load_n.tolist(),
        'measured_loads_n': [one.load_n for one in result.loads],
        'holds': sum(len(one.holds) for one in result.loads),
        'holds_left_out': sum(len(one.unsettled) for one in result.loads),
        'largest_contraction_percent': 100.0 * float(surfaces.strain.max()),
        'strain_u_rms_percent': 100.0 * float(np.sqrt(np.mean(surfaces.strain_u ** 2))),
        'half_distance_mean_percent': 100.0 * float(np.mean(np.abs(half))) if half.size else None,
        'half_distance_max_percent': 100.0 * float(np.max(np.abs(half))) if half.size else None,
        'monotone': surfaces.monotone, 'truth': truth, 'provenance': result.provenance,
        'remarks': result.remarks}


def document(result: 'Characterisation') -> dict[str, Any]:
    """Return everything as plain data: surfaces, uncertainties, holds, losses, summary."""
    s = result.surfaces
    return {
        'schema': 1, 'summary': summary(result),
        'muscle': {'length_m': result.dimensions.length_m, 'bore_m': result.dimensions.bore_m,
                   'dead_volume_m3': result.dimensions.dead_volume_m3,
                   'braid_angle_rad': result.dimensions.braid_angle_rad},
        'pressure_gauge_pa': s.pressure_gauge_pa.tolist(), 'load_n': s.load_n.tolist(),
        'strain': _plain(s.strain), 'strain_u': _plain(s.strain_u),
        'strain_u_parts': {name: _plain(part) for name, part in s.parts.items()},
        'half_distance_strain': _plain(s.half_distance),
        'air_mass_kg': _plain(s.air_mass_kg), 'pressure_u_pa': _plain(s.pressure_u_pa),
        'force_strain': _plain(s.force_strain), 'force_n': _plain(s.force_n),
        'force_u_n': _plain(s.force_u_n),
        'error_percent': None if result.truth is None else _plain(result.truth['error_percent']),
        'loads': [{'load_n': one.load_n, 'load_u_n': one.load_u_n, 'from': one.load_from,
                   'path': one.path, 'holds': [_hold(hold) for hold in one.holds],
                   'left_out': [_hold(hold) for hold in one.unsettled]}
                  for one in result.loads]}


def _plain(values: 'ArrayLike | None') -> list[Any] | None:
    """Return nested lists of six significant digits; what is not finite becomes None."""
    if values is None:
        return None
    array = np.asarray(values, dtype=float)
    if array.ndim > 1:
        return [_plain(row) for row in array]
    return [float(f'{value:.6g}') if np.isfinite(value) else None for value in array]


def _hold(hold: 'Hold') -> dict[str, Any]:
    data = {name: getattr(hold, name) for name in hold.__dataclass_fields__}
    return {name: None if isinstance(value, float) and not np.isfinite(value) else value
            for name, value in data.items()}


def holds_csv(result: 'Characterisation') -> str:
    """Return the settled holds as a table that ``pam characterise`` reads again."""
    stream = io.StringIO()
    for line in result.provenance:
        stream.write(f'# {line}\n')
    writer = csv.writer(stream, lineterminator='\n')
    writer.writerow(HOLD_COLUMNS)
    for one in result.loads:
        for hold in one.holds:
            writer.writerow([one.load_n, one.load_u_n, hold.branch, hold.pressure_gauge_pa,
                             hold.pressure_u_pa, hold.contraction_m, hold.contraction_u_m,
                             hold.drift_m])
    return stream.getvalue()


def _page(result: 'Characterisation', pictures: Mapping[str, str]) -> str:
    """Return the page: figures, uncertainty, loads, provenance."""
    s, short = result.surfaces, summary(result)
    numbers = [
        (f'{s.pressure_gauge_pa.size} × {s.load_n.size}', 'pressures × loads',
         f'{short["pressure_range_kpa"][0]:.0f} to {short["pressure_range_kpa"][1]:.0f} kPa, '
         f'0 to {s.load_n[-1]:g} N', ''),
        (f'{short["strain_u_rms_percent"]:.3f} %', 'standard uncertainty of contraction',
         'rms over the grid, in % contraction', '')]
    if short['half_distance_mean_percent'] is not None:
        numbers.append((f'{short["half_distance_mean_percent"]:.3f} %',
                        'half distance of the branches', 'mean; hysteresis, lumped', ''))
    if result.truth:
        numbers.append((f'{result.truth["rms_percent"]:.3f} %', 'error against the rig',
                        'rms of contraction on the grid',
                        'good' if result.truth['rms_percent'] <= 0.2 else 'bad'))
    drawn = ''.join(_picture(text, CAPTIONS[name]) for name, text in pictures.items())
    sections = [Section('figures', 'Surfaces', drawn),
                Section('uncertainty', 'Uncertainty', _uncertainty(s))]
    if result.loads:
        sections.append(Section('loads', 'Loads', table(
            ['load [N]', 'uncertainty [N]', 'from', 'holds', 'left out', 'recording'],
            [[f'{one.load_n:.2f}', f'{one.load_u_n:.3f}', one.load_from, len(one.holds),
              len(one.unsettled), one.path] for one in result.loads])))
    sections.append(Section('source', 'Where this comes from', ''.join(
        paragraph(line) for line in result.provenance + result.remarks)))
    return render('Characteristic surfaces', 'Quasi-static, the hysteresis lumped into the '
                  'mean curve.', sections, numbers, FOOTER)


def _picture(text: str, caption: str) -> str:
    """Return a figure whose image is in the page, in its colours, with its caption."""
    data = base64.b64encode(svg.as_image(text).encode('utf-8')).decode('ascii')
    return (f'<figure><img src="data:image/svg+xml;base64,{data}" '
            f'alt="{caption}"><figcaption>{caption}</figcaption></figure>')


def _uncertainty(s: 'Surfaces') -> str:
    """Return the plots of uncertainty and branch distance over pressure, and the parts."""
    rms = table(['part', 'rms over the grid [% contraction]'], [
        [name, f'{100 * np.sqrt(np.mean(part ** 2)):.4f}'] for name, part in s.parts.items()])
    shown = sorted({0, s.load_n.size // 3, 2 * s.load_n.size // 3})
    roles = ('measured', 'second', 'green')
    rows = []
    for title, surface in (('standard uncertainty [%]', s.strain_u),
                           ('half distance of branches [%]', s.half_distance)):
        traces = [figures.line(1e-3 * s.pressure_gauge_pa, 100.0 * surface[:, j],
                               f'{s.load_n[j]:g} N', role)
                  for j, role in zip(shown, roles) if np.all(np.isfinite(surface[:, j]))]
        if traces:
            rows.append((title, traces))
    return rms + (plot(figures.stack(rows, 'pressure [kPa gauge]')) if rows else '')
