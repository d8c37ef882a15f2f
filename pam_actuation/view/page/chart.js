// One plot on a canvas: columns of extremes against time.
'use strict';

const SLOTS = 1024;          // columns kept; more than are across the page
const GAP_S = 1.0;           // without a value for this long the line is broken
const LEFT = 46, RIGHT = 6, TOP = 6, BOTTOM = 18;
const LEAST_SPAN = {mm: 0.2, kPa: 4, V: 0.1, duty: 1, N: 2, '°': 0.2, 'N m': 0.1};

// The columns of one line, by column number.
class Trace {
  constructor(label) {
    this.label = label;
    this.column = new Float64Array(SLOTS).fill(NaN);
    this.first = new Float32Array(SLOTS);
    this.second = new Float32Array(SLOTS);
    this.newest = -Infinity;
  }

  clear() { this.column.fill(NaN); this.newest = -Infinity; }

  put(base, columns, first, second) {
    for (let k = 0; k < columns.length; k++) {
      const column = base + columns[k], slot = column % SLOTS;
      this.column[slot] = column; this.first[slot] = first[k]; this.second[slot] = second[k];
      if (column > this.newest) this.newest = column;
    }
  }

  // The newest value at a column or up to a second before it; NaN without one.
  at(column, reach) {
    for (let k = column; k > column - reach; k--) {
      if (this.column[k % SLOTS] === k) return this.second[k % SLOTS];
    }
    return NaN;
  }
}

function niceStep(span, wanted) {
  const raw = span / wanted, power = 10 ** Math.floor(Math.log10(raw)), ratio = raw / power;
  return power * (ratio <= 1 ? 1 : ratio <= 2 ? 2 : ratio <= 5 ? 5 : 10);
}

function shown(value, step) {
  const digits = Math.min(Math.max(-Math.floor(Math.log10(step) + 1e-9), 0), 4);
  if (!Number.isFinite(value)) return '–';
  const text = value.toFixed(digits);
  return Number(text) === 0 ? text.replace('-', '') : text;
}

class Chart {
  constructor(plot, traces) {
    this.unit = plot.unit;
    this.lines = plot.lines.map((line, k) => ({
      trace: traces[line.index],
      colour: `--line${plot.lines.length === 1 ? 1 : k % 4}`}));
    this.element = document.createElement('figure');
    this.element.dataset.plot = plot.key;
    const caption = document.createElement('figcaption'), title = document.createElement('b');
    title.textContent = `${plot.title} [${plot.unit}]`;
    caption.append(title);
    for (const line of this.lines) {
      const entry = document.createElement('span'), mark = document.createElement('i');
      line.value = document.createElement('output');
      mark.style.background = `var(${line.colour})`;
      entry.append(mark, `${line.trace.label} `, line.value);
      caption.append(entry);
    }
    this.canvas = document.createElement('canvas');
    this.canvas.setAttribute('role', 'img');
    this.canvas.setAttribute('aria-label', title.textContent);
    this.element.append(caption, this.canvas);
    this.low = 0; this.high = 1;
  }

  // `time` has count, width_s, base and now of the last message, and the cursor as a share.
  draw(time, style) {
    const canvas = this.canvas, ratio = window.devicePixelRatio || 1;
    const wide = canvas.clientWidth, high = canvas.clientHeight;
    if (!wide || !time) return;
    if (canvas.width !== Math.round(wide * ratio) || canvas.height !== Math.round(high * ratio)) {
      canvas.width = Math.round(wide * ratio); canvas.height = Math.round(high * ratio);
    }
    const pen = canvas.getContext('2d');
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, wide, high);
    const end = time.base + time.now, begin = end - time.count;
    const step = this.range(begin, end, high);
    const x = (column) => LEFT + (column - begin) / time.count * (wide - LEFT - RIGHT);
    const scale = (high - TOP - BOTTOM) / (this.high - this.low);
    const y = (value) => high - BOTTOM - (value - this.low) * scale;
    this.axes(pen, time, step, x, y, wide, high, style);
    pen.save();
    pen.beginPath(); pen.rect(LEFT, TOP - 2, wide - LEFT - RIGHT, high - TOP - BOTTOM + 4);
    pen.clip();
    pen.lineWidth = 1.4; pen.lineJoin = 'round';
    const gap = Math.max(Math.ceil(GAP_S / time.width_s), 2);
    for (const line of this.lines) this.trace(pen, line, begin, end, gap, x, y, style);
    this.markers(pen, time, end, x, high, style);
    if (time.cursor !== null) {
      const at = LEFT + time.cursor * (wide - LEFT - RIGHT);
      pen.strokeStyle = style('--soft'); pen.lineWidth = 1;
      pen.beginPath(); pen.moveTo(at, TOP); pen.lineTo(at, high - BOTTOM); pen.stroke();
    }
    pen.restore();
    const column = Math.floor(time.cursor === null ? end : begin + time.cursor * time.count);
    for (const line of this.lines) {
      const text = shown(line.trace.at(column, gap), step / 100);
      if (line.value.textContent !== text) line.value.textContent = text;
    }
  }

  markers(pen, time, end, x, high, style) {
    pen.font = '11px system-ui, sans-serif';
    pen.textBaseline = 'top';
    pen.strokeStyle = pen.fillStyle = style('--warn'); pen.lineWidth = 1;
    pen.setLineDash([4, 3]);
    const middle = x(end - time.count / 2);
    for (const [k, one] of (time.markers || []).entries()) {
      const column = end - (time.now_s - one.time_s) / time.width_s;
      if (column < end - time.count || column > end) continue;
      const at = Math.round(x(column)) + 0.5;
      pen.beginPath(); pen.moveTo(at, TOP); pen.lineTo(at, high - BOTTOM); pen.stroke();
      // Towards the middle, and neighbours in lines of their own.
      pen.textAlign = at < middle ? 'left' : 'right';
      pen.fillText(one.text, at < middle ? at + 3 : at - 3, TOP + 13 * (k % 3));
    }
    pen.setLineDash([]);
  }

  // Set the range of values to whole steps; return the step.
  range(begin, end, high) {
    let low = Infinity, top = -Infinity;
    for (const {trace} of this.lines) {
      for (let slot = 0; slot < SLOTS; slot++) {
        if (!(trace.column[slot] >= begin && trace.column[slot] <= end + 1)) continue;
        const a = trace.first[slot], b = trace.second[slot];
        if (Math.min(a, b) < low) low = Math.min(a, b);
        if (Math.max(a, b) > top) top = Math.max(a, b);
      }
    }
    if (low > top) { low = 0; top = 0; }
    if (this.unit === 'duty') { low = Math.min(low, 0); top = Math.max(top, 1); }
    const lack = (LEAST_SPAN[this.unit] || 0) - (top - low);
    if (lack > 0) { low -= lack / 2; top += lack / 2; }
    if (top - low < 1e-9) { low -= 0.5; top += 0.5; }
    const step = niceStep(top - low, Math.max(high / 45, 2));
    // Noise about a whole step asks for no further step.
    this.low = Math.min(Math.floor(low / step + 0.1) * step, low);
    this.high = Math.max(Math.ceil(top / step - 0.1) * step, top);
    return step;
  }

  axes(pen, time, step, x, y, wide, high, style) {
    pen.font = '11px system-ui, sans-serif';
    pen.fillStyle = style('--soft'); pen.strokeStyle = style('--rule'); pen.lineWidth = 1;
    pen.textAlign = 'right'; pen.textBaseline = 'middle';
    pen.beginPath();
    const stop = Math.floor(this.high / step + 1e-6);
    for (let k = Math.ceil(this.low / step - 1e-6); k <= stop; k++) {
      const value = k * step, at = Math.round(y(value)) + 0.5;
      pen.moveTo(LEFT, at); pen.lineTo(wide - RIGHT, at);
      pen.fillText(shown(value, step), LEFT - 5, at);
    }
    pen.textAlign = 'center'; pen.textBaseline = 'alphabetic';
    const span = time.count * time.width_s, every = niceStep(span, Math.max(wide / 90, 2));
    const last = time.end_s;        // of a bag: from its begin on; of a rig: before now
    const first = Math.ceil((last - span) / every - 1e-9) * every;
    for (let t = first; t <= last + 1e-9; t += every) {
      const at = Math.round(x(time.base + time.now - (last - t) / time.width_s)) + 0.5;
      pen.moveTo(at, TOP); pen.lineTo(at, high - BOTTOM);
      const label = shown(t, every);
      pen.fillText(`${label} s`, Math.min(Math.max(at, LEFT + 8), wide - 16), high - 5);
    }
    pen.stroke();
  }

  trace(pen, line, begin, end, gap, x, y, style) {
    const trace = line.trace;
    pen.strokeStyle = style(line.colour);
    pen.beginPath();
    let before = -Infinity;
    const stop = Math.min(trace.newest, Math.ceil(end) + 2);
    for (let column = Math.floor(begin) - 2; column <= stop; column++) {
      const slot = column % SLOTS;
      if (trace.column[slot] !== column) continue;
      const at = x(column + 0.25), first = y(trace.first[slot]), second = y(trace.second[slot]);
      if (column - before > gap) pen.moveTo(at, first); else pen.lineTo(at, first);
      if (second !== first) pen.lineTo(x(column + 0.75), second);
      before = column;
    }
    pen.stroke();
  }
}
