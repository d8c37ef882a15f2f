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

"""The page: sections in order, written as one self-contained HTML file."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
import html
from itertools import zip_longest
import json
from typing import Any, TYPE_CHECKING

from pam_actuation.report.assets import CSS, SCRIPT
from pam_sim.errors import InputError

if TYPE_CHECKING:
    from pam_sim.run import Run


@dataclass(frozen=True)
class Section:
    """
    One part of a page.

    ``body`` is HTML whose variable text is already escaped. A section with
    ``group`` true is a heading with its paragraph above the sections that follow.
    """

    key: str
    title: str
    body: str
    group: bool = False


def text(value: object) -> str:
    """Return a value as escaped HTML text."""
    return html.escape(str(value), quote=True)


def paragraph(value: str, kind: str = '') -> str:
    """Return an escaped paragraph, ``kind`` being a CSS class such as ``note``."""
    return f'<p class="{kind}">{text(value)}</p>' if kind else f'<p>{text(value)}</p>'


def told_of_runs(key: str, title: str, look: 'Callable[[Run], str]',
                 runs: 'Iterable[tuple[str, Run]]') -> Section | None:
    """Return the section on runs of which a look says a sentence, None where there is none."""
    told = [(name, said) for name, run in runs if (said := look(run))]
    return Section(key, title, ''.join(
        paragraph(f'{name}: {said}.') for name, said in told)) if told else None


def plot(figure: dict[str, Any], caption: str = '') -> str:
    """Return the HTML of one figure; its data are JSON beside it, drawn when scrolled to."""
    # '<' may not stand in a script element: '</script>' in a name would end it.
    data = json.dumps(figure, separators=(',', ':'), allow_nan=False).replace('<', '\\u003c')
    height = int(figure['layout'].get('height', 300))
    note = f'<figcaption>{text(caption)}</figcaption>' if caption else ''
    return (f'<figure><div class="plot" style="min-height:{height}px">'
            f'<script type="application/json">{data}</script></div>{note}</figure>')


def table(head: Sequence[str], rows: Iterable[Sequence[object]], kind: str = '') -> str:
    """
    Return an HTML table; cells are escaped, None becomes a dash.

    On a phone each row becomes a card in which every cell has its heading beside it. A table
    of the kind ``grid``, whose columns say nothing alone, scrolls instead.
    """
    def cell(value: object) -> str:
        return '–' if value is None else text(value)
    top = ''.join(f'<th>{cell(v)}</th>' for v in head)
    top = f'<thead><tr>{top}</tr></thead>' if head else ''
    cards = head and kind != 'grid'
    # The first cell is the title of the card.
    labels = [f' data-label="{cell(v)}"' if k else '' for k, v in enumerate(head)] \
        if cards else []
    body = ''.join('<tr>' + ''.join(
        f'<td{label or ""}>{cell(v)}</td>' for v, label in zip_longest(row, labels[:len(row)]))
        + '</tr>' for row in rows)
    kind = f'{kind} cards'.strip() if cards else kind
    return f'<div class="scroll"><table class="{kind}">{top}<tbody>{body}</tbody></table></div>'


def signed(value: float, digits: int = 0) -> str:
    """Return a number with its sign as text; what rounds to zero has none."""
    shown = f'{value:+.{digits}f}'
    return shown[1:] if float(shown) == 0.0 else shown


def key_numbers(numbers: list[tuple[str, str, str, str]]) -> str:
    """
    Return the HTML of the numbers a reader should see first.

    Parameters
    ----------
    numbers : list of (value, what, note, mood)
        Text of the number with its unit, what it is, a remark, and ``good``,
        ``bad`` or ``''``.

    """
    cells = ''.join(
        f'<div class="number {mood}"><span>{text(what)}</span><b>{text(value)}</b>'
        f'<small>{text(note)}</small></div>' for value, what, note, mood in numbers)
    return f'<div class="numbers">{cells}</div>'


def render(title: str, lead: str, sections: list[Section],
           numbers: list[tuple[str, str, str, str]] | tuple[()] = (), footer: str = '',
           of: str = '') -> str:
    """
    Return the whole page as text.

    Parameters
    ----------
    title, lead : str
        Heading and the sentence below it.
    sections : list of Section
        In reading order.
    numbers : list
        See ``key_numbers``; shown above all sections.
    footer : str
        Last line.
    of : str
        What the page is of, for programs; not shown.

    """
    links = ''.join(f'<a href="#{text(s.key)}">{text(s.title)}</a>' for s in sections
                    if s.group or not any(t.group for t in sections))
    parts = []
    for section in sections:
        tag = 'div' if section.group else 'section'
        kind = ' class="group"' if section.group else ''
        parts.append(f'<{tag}{kind} id="{text(section.key)}"><h2>{text(section.title)}</h2>'
                     f'{section.body}</{tag}>')
    return ('<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width, initial-scale=1">'
            f'<meta name="generator" content="pam_actuation {text(of)}">'
            f'<title>{text(title)}</title><style>{CSS}</style></head><body>'
            f'<header class="top"><h1>{text(title)}</h1>{paragraph(lead, "lead")}'
            f'<nav>{links}</nav>{key_numbers(numbers) if numbers else ""}</header>'
            f'<main>{"".join(parts)}</main><footer>{text(footer)}</footer>'
            f'{_drawing(sections)}</body></html>\n')


def _drawing(sections: list[Section]) -> str:
    """Return the scripts that draw the plots; a page without plots carries none."""
    if not any('class="plot"' in section.body for section in sections):
        return ''
    return f'<script>{plotly_script()}</script><script>{SCRIPT}</script>'


def plotly_script() -> str:
    """Return plotly's bundled JavaScript, licence comment included."""
    try:
        from plotly.offline import get_plotlyjs
    except ImportError as error:
        raise InputError(
            'a page needs the Python package plotly: pip install "plotly>=5.15"') from error
    return get_plotlyjs().replace('</script', '<\\/script')
