// What rules put out, as colours over two axes.
'use strict';

const ADD = [217, 95, 2], TAKE = [31, 110, 190];        // as `pam rules`: orange adds pressure

class Surface {
  constructor(title) {
    this.element = document.createElement('figure');
    this.caption = document.createElement('figcaption');
    const name = document.createElement('b');
    name.textContent = `${title} [kPa]`;
    this.scale = document.createElement('span');
    this.caption.append(name, this.scale);
    this.canvas = document.createElement('canvas');
    this.canvas.setAttribute('role', 'img');
    this.canvas.setAttribute('aria-label', name.textContent);
    this.element.append(this.caption, this.canvas);
    this.content = null;
    this.drawn = null;
  }

  draw(style) {
    const {canvas, content} = this, ratio = window.devicePixelRatio || 1;
    const wide = canvas.clientWidth, high = canvas.clientHeight;
    if (!wide || !content) return;
    const key = `${wide} ${high} ${style('--soft')}`;
    if (this.drawn === content && this.key === key) return;
    this.drawn = content; this.key = key;
    canvas.width = Math.round(wide * ratio); canvas.height = Math.round(high * ratio);
    const pen = canvas.getContext('2d');
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    const left = 52, right = 8, top = 6, bottom = 32, cells = content.cells;
    const w = (wide - left - right) / cells, h = (high - top - bottom) / cells;
    const most = content.values.reduce((max, value) => Math.max(max, Math.abs(value ?? 0)), 0);
    this.scale.textContent = `±${shown(most, most / 20 || 1)}: orange adds, blue takes off; `
      + 'newest of 60 s';
    content.values.forEach((value, k) => {
      if (value === null) return;
      const [red, green, blue] = value >= 0 ? ADD : TAKE;
      pen.fillStyle = `rgba(${red}, ${green}, ${blue}, ${0.08 + 0.92 * Math.abs(value) / (most || 1)})`;
      pen.fillRect(left + k % cells * w, high - bottom - (Math.floor(k / cells) + 1) * h,
        w + 0.5, h + 0.5);
    });
    pen.strokeStyle = style('--text'); pen.lineWidth = 2;
    pen.strokeRect(left + content.now[0] * w, high - bottom - (content.now[1] + 1) * h, w, h);
    pen.strokeStyle = style('--rule'); pen.lineWidth = 1;
    pen.strokeRect(left + 0.5, top + 0.5, wide - left - right, high - top - bottom);
    pen.font = '11px system-ui, sans-serif'; pen.fillStyle = style('--soft');
    const ends = (axis) => axis.range.map((value) => shown(value, Math.abs(axis.range[1]) / 10));
    const x = ends(content.x), y = ends(content.y), base = high - bottom;
    pen.textAlign = 'left'; pen.fillText(x[0], left, base + 14);
    pen.textAlign = 'right'; pen.fillText(x[1], wide - right, base + 14);
    pen.textAlign = 'center'; pen.fillText(content.x.label, (left + wide - right) / 2, base + 26);
    pen.textAlign = 'right';
    pen.fillText(y[0], left - 5, base); pen.fillText(y[1], left - 5, top + 10);
    pen.save();
    pen.translate(12, (top + base) / 2); pen.rotate(-Math.PI / 2); pen.textAlign = 'center';
    pen.fillText(content.y.label, 0, 0);
    pen.restore();
  }
}
