// Histogram of the channels' light, with handles for black and white and the curve of the stretch.

import {flatInk, h, sizeTo} from './dom.js';
import {level} from './stretch.js';
import {text} from './scale.js';

const bins = 160, mostPixels = 16384, beyondWhite = 4;

/// Counts of light in bins of the scale that axis() spans, for each channel.
function countLight(sums, tone, gain, channels) {
  const axis = axisOf(tone), counts = [];
  const stride = Math.max(Math.floor(sums.length / 4 / mostPixels), 1);
  for (let c = 0; c < channels; ++c) {
    const count = new Float64Array(bins);
    for (let i = 0; i < sums.length / 4; i += stride) {
      const light = Math.max(sums[4 * i + c] - tone.black[c], 0) * tone.factor[c] * gain;
      ++count[Math.min(Math.floor(axis.place(light) * bins), bins - 1)];
    }
    counts.push(count);
  }
  return counts;
}

/// The histogram's axis: asinh of the tone's own slope, up to a few times its white.
function axisOf(tone) {
  const most = beyondWhite * tone.white, slope = Math.max(tone.slope, 1e-3 / Math.max(most, 1e-300));
  const end = Math.asinh(slope * most);
  return {most, place: (light) => Math.min(Math.max(Math.asinh(slope * light) / end, 0), 1),
          light: (place) => Math.sinh(place * end) / slope};
}

export class Histogram {
  constructor(app) {
    this.app = app;
    this.canvas = h('canvas', {role: 'img', 'aria-label': 'Histogram of the light'});
    this.handles = Object.fromEntries(['black', 'white'].map((name) => [name, this.handle(name)]));
    this.element = h('div', {class: 'histogram'}, this.canvas, ...Object.values(this.handles));
    new ResizeObserver(() => this.draw()).observe(this.element);
    app.stage.ondraw(() => this.refresh());
  }

  handle(name) {
    const handle = h('div', {class: `handle ${name}`, role: 'slider', tabIndex: 0, title: `${name} point`,
                             'aria-label': `${name} point`, 'aria-valuemin': 0, 'aria-valuemax': 100});
    handle.addEventListener('pointerdown', (event) => { handle.setPointerCapture(event.pointerId); handle.focus(); event.preventDefault(); });
    handle.addEventListener('pointermove', (event) => {
      if (!handle.hasPointerCapture(event.pointerId)) return;
      const box = this.canvas.getBoundingClientRect();
      this.put(name, (event.clientX - box.left) / box.width);
    });
    handle.addEventListener('keydown', (event) => {
      const step = {ArrowLeft: -1, ArrowRight: 1, ArrowDown: -1, ArrowUp: 1}[event.key];
      if (!step) return;
      event.preventDefault();
      event.stopPropagation();
      const {ui} = this.app;
      this.put(name, axisOf(ui.tone).place(ui.look[name]) + step * (event.shiftKey ? 0.05 : 0.01));
    });
    return handle;
  }

  put(name, place) {
    const {ui} = this.app;
    if (!ui.tone) return;
    const axis = axisOf(ui.tone), light = axis.light(Math.min(Math.max(place, 0), 1));
    const {black, white} = ui.look;
    ui.look.auto = false;
    if (name === 'black') ui.look.black = Math.min(light, 0.98 * white);
    else ui.look.white = Math.max(light, black * 1.02, 1e-9 * axis.most);
    ui.say('look');
  }

  /// Counts again where the sums are new; draws.
  refresh() {
    const {ui, picture, preview} = this.app;
    if (!ui.tone || !this.element.offsetParent) return;
    // Nothing is read back from the GPU while shares of light move.
    const sums = picture.read ?? (preview.isFinal && !preview.shares ? picture.sums() : null);
    const key = `${ui.tone.slope}/${ui.tone.white}/${ui.look.exposure}`;
    if (sums && (sums !== this.sums || key !== this.key)) {
      this.counts = countLight(sums, ui.tone, 2 ** ui.look.exposure, preview.isGrey ? 1 : 3);
      this.sums = sums;
      this.key = key;
    }
    this.draw();
  }

  /// Draws, unless nothing has changed since the last drawing.
  draw() {
    const {ui} = this.app, box = this.canvas.getBoundingClientRect();
    if (!ui.tone || !this.counts || box.width === 0) return;
    const ratio = window.devicePixelRatio || 1;
    const size = [box.width, box.height].map((side) => Math.round(side * ratio));
    const {mode, black, white, slope, gamma} = ui.look, {tone} = ui;
    const key = [...size, mode, black, white, slope, gamma, tone.slope, tone.white].join();
    if (key === this.drawn?.key && this.counts === this.drawn.counts) return;
    this.drawn = {key, counts: this.counts};
    const [width, height] = size;
    sizeTo(this.canvas, width, height);
    const ink = flatInk(this.canvas);
    ink.clearRect(0, 0, width, height);
    ink.globalCompositeOperation = 'lighter';
    const colours = this.counts.length === 1 ? ['#5d6269'] : ['#6e2b28', '#27582f', '#273f74'];
    const most = Math.max(...this.counts.flatMap((count) => [...count.subarray(1)]), 1);
    this.counts.forEach((count, c) => {
      ink.fillStyle = colours[c];
      ink.beginPath();
      ink.moveTo(0, height);
      count.forEach((value, i) => {
        const y = height * (1 - 0.94 * Math.min(Math.log1p(value) / Math.log1p(most), 1));
        ink.lineTo(i / bins * width, y);
        ink.lineTo((i + 1) / bins * width, y);
      });
      ink.lineTo(width, height);
      ink.fill();
    });
    ink.globalCompositeOperation = 'source-over';
    this.drawCurve(ink, width, height, ratio);
    this.place();
  }

  drawCurve(ink, width, height, ratio) {
    const {ui: {look, tone}} = this.app, axis = axisOf(tone);
    const shape = look.mode === 'lupton' ? 'asinh' : look.mode;
    ink.strokeStyle = '#e9e4d8';
    ink.lineWidth = 1.25 * ratio;
    ink.beginPath();
    for (let x = 0; x <= width; x += 2) {
      const light = Math.max(axis.light(x / width) - look.black, 0);
      const shown = Math.min(level(shape, light, look.slope, look.white - look.black), 1) ** (1 / look.gamma);
      ink.lineTo(x, height - 1 - shown * (height - 2));
    }
    ink.stroke();
  }

  place() {
    const {ui} = this.app, axis = axisOf(ui.tone);
    for (const [name, handle] of Object.entries(this.handles)) {
      const place = 100 * axis.place(ui.look[name]);
      handle.style.left = `${place}%`;
      handle.setAttribute('aria-valuenow', Math.round(place));
      handle.setAttribute('aria-valuetext', text(ui.look[name]));
    }
  }
}
