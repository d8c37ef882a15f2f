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

"""Style sheet and script of the page, kept in Python so that they are always installed."""

# Of the pages, and of the still figures that are images in them.
COLOURS = """
:root { color-scheme: light dark;
  --bg: #f6f7f8; --card: #ffffff; --text: #1c2126; --soft: #5c6670; --rule: #d9dee3;
  --good: #00694e; --bad: #a63c00; --accent: #00578a; --shade: #0002; --pure: 100%; }
@media (prefers-color-scheme: dark) { :root {
  --bg: #14181b; --card: #1d2226; --text: #e7eaec; --soft: #a0aab3; --rule: #353d44;
  --good: #4fd1a5; --bad: #ff9d5c; --accent: #6cc0f5; --shade: #fff3; --pure: 60%; } }
"""

CSS = COLOURS + """
* { box-sizing: border-box; }
body { margin: 0; background: var(--bg); color: var(--text);
  font: 16px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", sans-serif; }
main, header.top { max-width: 1120px; margin: 0 auto; padding: 0 20px; }
header.top { padding-top: 30px; }
h1 { font-size: 1.75rem; line-height: 1.2; margin: 0 0 .3rem; }
h2 { font-size: 1.25rem; margin: 0 0 .5rem; }
h3 { font-size: 1.02rem; margin: 1.2rem 0 .3rem; }
p { max-width: 74ch; margin: .35rem 0 .7rem; }
p.lead { font-size: 1.05rem; } .soft, figcaption, .note { color: var(--soft); }
.note, figcaption { font-size: .9rem; }
nav { display: flex; flex-wrap: wrap; gap: 4px 16px; margin: .8rem 0 0; font-size: .93rem; }
a { color: var(--accent); }
section { background: var(--card); border: 1px solid var(--rule); border-radius: 8px;
  padding: 18px 20px; margin: 18px 0; }
.group { margin: 38px 0 6px; padding: 0 2px; }
.group h2 { font-size: 1.45rem; margin-bottom: .25rem; }
.numbers { display: grid; grid-template-columns: repeat(auto-fit, minmax(215px, 1fr));
  gap: 12px; margin: 16px 0 0; }
.number { background: var(--card); border: 1px solid var(--rule); border-radius: 8px;
  padding: 12px 14px; }
.number b { display: block; font-size: 1.5rem; line-height: 1.25; font-weight: 650; }
.number span { display: block; font-size: .9rem; }
.number small { color: var(--soft); display: block; margin-top: 2px; }
.good b { color: var(--good); } .bad b { color: var(--bad); }
/* What does not fit scrolls; a shadow at the edge says so. */
.scroll { overflow-x: auto;
  background:
    linear-gradient(90deg, var(--card) 30%, transparent) left / 40px 100% no-repeat local,
    linear-gradient(270deg, var(--card) 30%, transparent) right / 40px 100% no-repeat local,
    linear-gradient(90deg, var(--shade), transparent) left / 12px 100% no-repeat scroll,
    linear-gradient(270deg, var(--shade), transparent) right / 12px 100% no-repeat scroll; }
table { border-collapse: collapse; font-size: .93rem; font-variant-numeric: tabular-nums; }
th, td { padding: 5px 14px 5px 0; border-bottom: 1px solid var(--rule); text-align: right;
  vertical-align: top; }
th:first-child, td:first-child { text-align: left; }
thead th { color: var(--soft); font-weight: 600; }
table.facts td { text-align: left; overflow-wrap: anywhere; } table.facts td:first-child {
  color: var(--soft); white-space: nowrap; }
td.text, th.text, table.words th, table.words td { text-align: left; }
.plot { width: 100%; margin: 4px 0 0; } figure { margin: 8px 0 4px; }
figure svg, figure img { max-width: 100%; height: auto; }
details { margin: .5rem 0; } summary { cursor: pointer; color: var(--accent); }
pre { overflow-x: auto; font-size: .82rem; background: var(--bg); padding: 10px; margin: 6px 0;
  border-radius: 6px; max-height: 420px; }
footer { max-width: 1120px; margin: 0 auto; padding: 6px 20px 40px; color: var(--soft);
  font-size: .88rem; }
/* On a phone every row of a table is a card: no value stands outside the screen. */
@media (max-width: 640px) { section { padding: 14px 12px; } main, header.top { padding: 0 10px; }
  figure.scroll svg { max-width: none; width: 600px; }
  table.cards, table.cards tbody, table.cards tr { display: block; }
  table.cards thead, table.cards td:empty { display: none; }
  table.cards tr { border-bottom: 1px solid var(--rule); padding: 6px 0; }
  table.cards tr td { display: flex; justify-content: space-between; gap: 14px; border: 0;
    padding: 1px 0; text-align: right; white-space: normal; overflow-wrap: anywhere; }
  table.cards tr td::before { content: attr(data-label); color: var(--soft); text-align: left;
    font-weight: 400; flex: 0 1 auto; min-width: 30%; }
  table.cards tr td:first-child { font-weight: 600; color: var(--text); text-align: left; }
}
/* Paper is white and has an end: nothing is cut by the edge of a page. */
@media print {
  :root { color-scheme: light; --bg: #ffffff; --card: #ffffff; --text: #1c2126; --soft: #5c6670;
    --rule: #d9dee3; --good: #00694e; --bad: #a63c00; --accent: #00578a; --shade: transparent;
    --pure: 100%; }
  nav, summary::marker { display: none; } main, header.top { max-width: none; padding: 0; }
  section { border: 0; padding: 4px 0; margin: 8px 0; }
  figure, tr, pre, .number { break-inside: avoid; } h2, h3, thead { break-after: avoid; }
  .plot { min-height: 0 !important; } .scroll { overflow: visible; background: none; }
  pre { max-height: none; overflow: visible; white-space: pre-wrap; }
  figure svg { max-height: 250mm; } }
"""

SCRIPT = """
(function () {
  'use strict';
  var dark = window.matchMedia ? window.matchMedia('(prefers-color-scheme: dark)') : null;
  var roles = {
    reference: ['#222222', '#f0f0f0'], measured: ['#0072b2', '#56b4e9'],
    command: ['#b07400', '#e69f00'], simulated: ['#d55e00', '#ff8c42'],
    residual: ['#8e4a86', '#cc79a7'], green: ['#007a5a', '#2fc79b'],
    frozen: ['#8a929a', '#9aa3ab'], after: ['#0072b2', '#56b4e9'],
    before: ['#8a929a', '#9aa3ab'], second: ['#d55e00', '#ff8c42']
  };
  var printing = false, PAPER = { width: 680, height: 920 };     // px of A4 within its margins
  var ink = { '--text': '#1c2126', '--soft': '#5c6670', '--rule': '#d9dee3', '--card': '#ffffff',
    '--accent': '#00578a' };
  function colour(role) {
    var fill = role.slice(-5) === '+fill';
    var pair = roles[fill ? role.slice(0, -5) : role] || roles.measured;
    var hex = pair[!printing && dark && dark.matches ? 1 : 0];
    return fill ? hex + '33' : hex;
  }
  function paint(value) {
    if (typeof value === 'string') {
      return value.charAt(0) === '@' ? colour(value.slice(1)) : value;
    }
    if (Array.isArray(value)) {
      return value.length && typeof value[0] === 'number' ? value : value.map(paint);
    }
    if (value && typeof value === 'object') {
      var out = {};
      Object.keys(value).forEach(function (key) { out[key] = paint(value[key]); });
      return out;
    }
    return value;
  }
  function css(name) {
    return printing ? ink[name]
      : getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  }
  function draw(node) {
    if (!window.Plotly) { return; }
    var source = node.querySelector('script');
    if (source) { node.figure = JSON.parse(source.textContent); }
    var figure = paint(node.figure), layout = figure.layout;
    layout.paper_bgcolor = layout.plot_bgcolor = 'rgba(0,0,0,0)';
    layout.font = { family: getComputedStyle(document.body).fontFamily, size: 12.5,
      color: css('--text') };
    layout.dragmode = 'zoom';
    if (printing) {
      layout.width = PAPER.width;
      layout.height = Math.min(layout.height || 300, PAPER.height);
    }
    layout.hoverlabel = { bgcolor: css('--card'), bordercolor: css('--rule'),
      font: { color: css('--text') } };
    Object.keys(layout).forEach(function (key) {
      if (/^[xy]axis/.test(key)) {
        var axis = layout[key];
        axis.gridcolor = css('--rule'); axis.zerolinecolor = css('--rule');
        axis.linecolor = css('--soft'); axis.automargin = axis.automargin || false;
        if (!axis.title) { delete axis.title; } else { axis.title.standoff = 8; }
      }
      if (/^legend/.test(key)) { layout[key].bgcolor = 'rgba(0,0,0,0)'; }
    });
    if (source) { node.removeChild(source); }
    layout.modebar = { bgcolor: 'rgba(0,0,0,0)', color: css('--soft'),
      activecolor: css('--accent') };
    Plotly.react(node, figure.data, layout, { responsive: !printing, displaylogo: false,
      toImageButtonOptions: { format: 'svg' },
      displayModeBar: 'hover', modeBarButtons: [['zoom2d', 'pan2d', 'resetScale2d', 'toImage']] });
    node.drawn = true;
  }
  function start() {
    var nodes = Array.prototype.slice.call(document.querySelectorAll('.plot'));
    if ('IntersectionObserver' in window) {
      var seen = new IntersectionObserver(function (entries) {
        entries.forEach(function (entry) {
          if (entry.isIntersecting) { seen.unobserve(entry.target); draw(entry.target); }
        });
      }, { rootMargin: '500px' });
      nodes.forEach(function (node) { seen.observe(node); });
    } else { nodes.forEach(draw); }
    if (dark && dark.addEventListener) {
      dark.addEventListener('change', function () {
        nodes.forEach(function (node) { if (node.drawn) { draw(node); } });
      });
    }
    function redraw(paper) {
      printing = paper;
      nodes.forEach(draw);
    }
    window.addEventListener('beforeprint', function () { redraw(true); });
    window.addEventListener('afterprint', function () { redraw(false); });
    document.querySelectorAll('details').forEach(function (node) {
      node.addEventListener('toggle', function () { window.dispatchEvent(new Event('resize')); });
    });
  }
  if (document.readyState === 'loading') { document.addEventListener('DOMContentLoaded', start); }
  else { start(); }
})();
"""
