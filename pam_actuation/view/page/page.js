// The page: keeps the connection, shows what comes, asks for what is pressed.
'use strict';

const $ = (id) => document.getElementById(id);
const SURE_MS = 4000, ANSWER_MS = 4000, PLAY_MS = 20000, MOST_WAIT_MS = 2000;
const LEVELS = ['ok', 'warning', 'error', 'silent'];

const page = {
  socket: null, live: true, wait_ms: 250, number: 0, asked: new Map(), hello: null,
  charts: [], traces: [], time: null, layout: null, cursor: null, held: false, dirty: true,
  views: '', frames: 0, drawn: 0, end_s: null, playing: false, pending: false, drivers: [], players: [],
  surfaces: [], surfaceTitles: '', markers: [],
};

// ---- connection ----

function connect() {
  const scheme = location.protocol === 'https:' ? 'wss:' : 'ws:';
  const socket = new WebSocket(`${scheme}//${location.host}/socket`);
  socket.binaryType = 'arraybuffer';
  page.socket = socket;
  socket.onopen = () => { page.wait_ms = 250; };
  socket.onmessage = (event) => {
    if (typeof event.data === 'string') heard(JSON.parse(event.data)); else picture(event.data);
  };
  socket.onclose = (event) => {
    setLink(false);
    for (const [number, one] of page.asked) unanswered(number, one, 'the connection was lost');
    page.pending = false;
    if (event.code === 1013) { banner('bad', event.reason); page.wait_ms = MOST_WAIT_MS; }
    setTimeout(connect, page.wait_ms);
    page.wait_ms = Math.min(2 * page.wait_ms, MOST_WAIT_MS);
  };
}

function send(content) {
  if (page.socket.readyState !== WebSocket.OPEN) return false;
  page.socket.send(JSON.stringify(content));
  return true;
}

function setLink(open) {
  $('link').textContent = !open ? 'no connection' : page.live ? 'live' : 'bag';
  $('link').className = `badge ${open ? 'good' : 'bad'}`;
  document.body.classList.toggle('off', !open);
  buttons();
}

function buttons() {
  const open = page.socket.readyState === WebSocket.OPEN;
  $('stop').hidden = $('reset').hidden = !page.live;
  $('stop').disabled = !open || !page.drivers.length;
  $('reset').disabled = !open || !driversShown().length;
  $('play_row').hidden = !page.players.length;
  $('begin').disabled = $('halt').disabled = !open;
  $('marking').hidden = !page.live;
  $('mark').disabled = !open;
  $('stop').title = open && !page.drivers.length ? 'No valve driver is running.'
    : 'Every valve driver vents its muscle and stays so until reset.';
}

function heard(content) {
  ({hello, state, layout, answer, rules, error: (one) => banner('bad', one.message)})[content.type]?.(
    content);
}

function hello(content) {
  page.live = content.live; page.hello = content;
  $('title').textContent = content.title;
  document.title = `${content.title || 'live'} – pam view`;
  if (!$('window').options.length) {
    for (const value of content.windows_s) $('window').append(new Option(`${value} s`, value));
    $('window').value = remembered('window', page.live ? '10' : longWindow(content));
  }
  $('experiment').replaceChildren(...content.experiments.map((one) => new Option(one, one)));
  $('odd').hidden = !content.remarks.length;
  listed('remarks', content.remarks);
  $('player').hidden = page.live; $('hold').hidden = !page.live;
  if (!page.live) {
    $('slider').max = content.length_s.toFixed(2);
    if (page.end_s === null) {
      const window_s = Number($('window').value);
      page.end_s = Math.min(content.length_s, window_s);
    }
  }
  setLink(true);
  watch();
}

function longWindow(content) {
  const long = content.windows_s.find((value) => value >= content.length_s);
  return String(long || content.windows_s.at(-1));
}

function watch() {
  const content = {do: 'watch', view: $('view').value, window_s: Number($('window').value)};
  if (!page.live) {
    if (page.pending) { page.again = true; return; }
    page.pending = true; page.again = false;
    content.end_s = page.end_s;
    $('slider').value = page.end_s;
    $('time').textContent = `${page.end_s.toFixed(2)} of ${page.hello.length_s.toFixed(2)} s`;
  }
  send(content);
}

// ---- what comes ----

function layout(content) {
  page.layout = content.layout;
  page.traces = [];
  for (const plot of content.plots) {
    for (const line of plot.lines) page.traces[line.index] = new Trace(line.label);
  }
  page.charts = content.plots.map((plot) => new Chart(plot, page.traces));
  $('plots').replaceChildren(...page.charts.map((chart) => chart.element));
  for (const chart of page.charts) {
    chart.canvas.addEventListener('pointermove', (event) => setCursor(chart, event));
    chart.canvas.addEventListener('pointerleave', () => { page.cursor = null; page.dirty = true; });
  }
  if (!page.charts.length) nothing();
  page.time = null;
}

function nothing() {
  const text = document.createElement('p');
  text.className = 'empty';
  text.textContent = 'No signal of a rig yet. Start one, such as: pam up rig --experiment '
    + 'sine_quarter_hz. Both need the same ROS domain.';
  $('plots').replaceChildren(text);
}

function picture(data) {
  const length = new DataView(data).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
  page.pending = false;
  if (page.again) watch();
  if (page.held || head.layout !== page.layout) return;
  let place = 4 + length;
  head.sizes.forEach((size, k) => {
    const trace = page.traces[k];
    if (head.kind === 'all') trace.clear();
    trace.put(head.base, new Int32Array(data, place, size),
      new Float32Array(data, place + 4 * size, size),
      new Float32Array(data, place + 8 * size, size));
    place += 12 * size;
  });
  page.time = head;
  page.time.end_s = page.live ? 0 : head.now_s - page.hello.begin_s;
  page.dirty = true;
}

function state(content) {
  page.drivers = content.drivers;
  page.players = content.players;
  buttons();
  const views = content.namespaces.filter((one) => !content.namespaces.some(
    (other) => other !== one && one.startsWith(`${other}/`)));
  const below = content.namespaces.filter((one) => !views.includes(one));
  const options = [...(views.length > 1 ? [''] : []), ...views, ...below];
  if (options.join() !== page.views) {
    page.views = options.join();
    const before = $('view').value;
    $('view').replaceChildren(...options.map((one) => new Option(one || 'all', one)));
    $('view').value = options.includes(before) ? before : (options[0] ?? '');
    watch();
  }
  $('nodes').replaceChildren(...content.nodes.map(nodeItem));
  if (!content.nodes.length) $('nodes').textContent = 'No node has said anything yet.';
  $('topics').replaceChildren(...content.topics.map(topicRow));
  setMarkers(content.markers);
  if (page.live && !content.namespaces.length && !page.charts.length) nothing();
}

// ---- markers ----

function setMarkers(markers) {
  const view = $('view').value;
  page.markers = markers.filter((one) => !view || `${one.namespace}/`.startsWith(`${view}/`)
    || `${view}/`.startsWith(`${one.namespace}/`));
  const texts = page.markers.map((one) => `${markerTime(one)}  ${one.text}`);
  if (texts.join('\n') === page.markerTexts) return;
  page.markerTexts = texts.join('\n');
  $('marked').hidden = !texts.length;
  listed('markers', texts.reverse());
  page.dirty = true;
}

function listed(id, texts) {
  $(id).replaceChildren(...texts.map((text) => {
    const item = document.createElement('li');
    item.textContent = text;
    return item;
  }));
}

function markerTime(marker) {
  return page.live ? new Date(marker.time_s * 1000).toLocaleTimeString()
    : `${(marker.time_s - page.hello.begin_s).toFixed(2)} s`;
}

function nodeItem(node) {
  const item = document.createElement('li'), name = document.createElement('b');
  const text = document.createElement('span'), more = document.createElement('small');
  item.className = `l${node.level}`;
  item.dataset.node = node.name;
  name.textContent = `${node.name}: ${LEVELS[node.level] ?? node.level}`;
  text.textContent = node.message;
  const values = node.values, facts = [];
  if (values['loop.missed'] !== undefined) {
    facts.push(`${(1000 / values['loop.period_mean_ms']).toFixed(0)} Hz, `
      + `${values['loop.missed']} ticks missed`);
  }
  const lost = Object.entries(values).filter(([key]) => key.startsWith('lost.'))
    .reduce((sum, [, count]) => sum + Number(count), 0);
  if (lost) facts.push(`${lost} messages lost`);
  more.textContent = facts.join('; ');
  item.append(name, text, more);
  return item;
}

function topicRow(topic) {
  const row = document.createElement('tr');
  for (const text of [topic.name, topic.rate_hz.toFixed(0), topic.lost ?? '–']) {
    row.insertCell().textContent = text;
  }
  if (topic.lost) row.lastChild.className = 'bad';
  if (!topic.rate_hz) row.children[1].className = 'bad';
  return row;
}

function rules(content) {
  if (page.held) return;
  const titles = content.surfaces.map((one) => one.title).join();
  if (titles !== page.surfaceTitles) {
    page.surfaceTitles = titles;
    page.surfaces = content.surfaces.map((one) => new Surface(one.title));
    $('rules').replaceChildren(...page.surfaces.map((one) => one.element));
  }
  page.surfaces.forEach((one, k) => { one.content = content.surfaces[k]; });
  page.dirty = true;
}

// ---- emergency stop and reset ----

// Those of the rig that is shown. A stop goes to all, a reset to these only.
function driversShown() {
  return page.drivers.filter((one) => one.startsWith(`${$('view').value}/`));
}

function ask(action, words, more = {}) {
  const number = ++page.number, of_driver = ['emergency_stop', 'reset'].includes(action);
  const asked = action === 'mark' ? [$('view').value || 'all rigs'] : !of_driver ? page.players
    : action === 'reset' ? driversShown() : page.drivers;
  if (!send({do: action, number, ...more})) {
    banner('bad', `${words} was NOT sent: no connection.`);
    return;
  }
  banner('', `${words}: asking ${asked.join(', ')} …`);
  const one = {words, of_driver};
  one.timer = setTimeout(() => unanswered(number, one, 'nothing came back'),
    one.of_driver ? ANSWER_MS : PLAY_MS);
  page.asked.set(number, one);
}

function unanswered(number, one, why) {
  clearTimeout(one.timer);
  page.asked.delete(number);
  banner('bad', `${one.words} is NOT confirmed: ${why}.`
    + (one.of_driver ? ' Use the switch of the air supply.' : ''));
}

function answer(content) {
  const one = page.asked.get(content.number);
  if (!one) return;
  clearTimeout(one.timer);
  page.asked.delete(content.number);
  const results = content.results, good = results.length && results.every((each) => each.ok);
  const texts = results.map((each) => `${each.node}: ${each.message}`);
  banner(good ? 'good' : 'bad', good ? `${one.words} confirmed. ${texts.join('; ')}`
    : `${one.words} is NOT confirmed by all: ${texts.join('; ') || 'nobody was there'}.`);
}

function banner(kind, text) {
  $('banner').className = kind;
  $('banner').textContent = text;
  $('banner').hidden = !text;
}

$('stop').onclick = () => ask('emergency_stop', 'Emergency stop');
// What moves a muscle or lets pressure in asks for a second press. Where `about` tells
// something else by then, that one counts as the first.
function twice(id, words, action, about = () => '') {
  const button = $(id), first = button.textContent;
  let told = null;
  const calm = () => {
    clearTimeout(button.timer);
    told = null;
    button.classList.remove('sure'); button.textContent = first;
  };
  button.onclick = () => {
    const text = about(), sure = told === text;
    calm();
    if (sure) { action(); return; }
    told = text;
    button.classList.add('sure'); button.textContent = words;
    if (text) banner('', text);
    button.timer = setTimeout(() => {
      calm();
      if (text && $('banner').textContent === text) banner('', '');
    }, SURE_MS);
  };
}
twice('reset', 'Press again to reset', () => ask('reset', 'Reset', {view: $('view').value}),
  () => `A second press resets ${driversShown().join(', ')}.`);
twice('begin', 'Press again to start', () => ask('play', `Start of ${$('experiment').value}`, {
  view: $('view').value, experiment: $('experiment').value}));
$('marking').onsubmit = (event) => {
  event.preventDefault();
  ask('mark', `Marker "${$('marker').value.trim()}"`, {
    view: $('view').value, text: $('marker').value});
  $('marker').value = '';
};
$('halt').onclick = () => ask('halt', 'End of the experiment', {view: $('view').value});

// ---- settings ----

function remembered(name, otherwise) {
  try { return localStorage.getItem(`pam_${name}`) ?? otherwise; } catch { return otherwise; }
}

function remember(name, value) {
  try { localStorage.setItem(`pam_${name}`, value); } catch { /* a private window */ }
}

function setCursor(chart, event) {
  const box = chart.canvas.getBoundingClientRect();
  const share = (event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT);
  page.cursor = share >= 0 && share <= 1 ? share : null;
  page.dirty = true;
}

function setTheme(name) {
  if (name) document.documentElement.dataset.theme = name;
  else delete document.documentElement.dataset.theme;
  page.dirty = true;
}

$('view').onchange = () => { buttons(); watch(); };
$('window').onchange = () => {
  if (page.live) remember('window', $('window').value);
  watch();
};
$('hold').onclick = () => {
  page.held = !page.held;
  $('hold').setAttribute('aria-pressed', page.held);
  if (!page.held) watch();
};
$('theme').onchange = () => { remember('theme', $('theme').value); setTheme($('theme').value); };
$('theme').value = remembered('theme', '');
setTheme($('theme').value);
matchMedia('(prefers-color-scheme: dark)').onchange = () => { page.dirty = true; };
new ResizeObserver(() => { page.dirty = true; }).observe(document.body);

// ---- the player of a bag ----

$('slider').oninput = () => { page.end_s = Number($('slider').value); watch(); };
$('play').onclick = () => setPlaying(!page.playing);

function setPlaying(playing) {
  page.playing = playing;
  if (playing && page.end_s >= page.hello.length_s) page.end_s = 0;
  page.last_ms = performance.now();
  $('play').textContent = playing ? '❚❚' : '▶';
  $('play').setAttribute('aria-label', playing ? 'Pause' : 'Play');
}

setInterval(() => {
  if (!page.playing) return;
  const now_ms = performance.now();
  page.end_s = Math.min(page.end_s + (now_ms - page.last_ms) / 1000 * Number($('speed').value),
    page.hello.length_s);
  page.last_ms = now_ms;
  watch();
  if (page.end_s >= page.hello.length_s) setPlaying(false);
}, 50);

// ---- drawing ----

function draw() {
  requestAnimationFrame(draw);
  if (!page.dirty || !page.time) return;
  page.dirty = false;
  page.frames++; page.drawn++;
  const styles = getComputedStyle(document.documentElement), known = {};
  const style = (name) => known[name] ??= styles.getPropertyValue(name).trim();
  const time = {...page.time, cursor: page.cursor, markers: page.markers};
  for (const chart of page.charts) chart.draw(time, style);
  for (const one of page.surfaces) one.draw(style);
}

setInterval(() => {
  $('fps').textContent = page.live && page.time ? `${page.frames} frames/s` : '';
  page.fps = page.frames;
  page.frames = 0;
}, 1000);

connect();
buttons();
draw();
