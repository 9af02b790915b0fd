// The strip below the picture: value, place and sky position under the cursor, and the colour bar.

import {$, flatInk, sizeTo} from './dom.js';
import {colour, lightOf} from './stretch.js';
import {text} from './scale.js';
import {pointAt} from './view.js';
import {skyOf} from './wcs.js';

function sexagesimal(value, digits) {
  const size = Math.abs(value), whole = Math.floor(size), minutes = Math.floor((size - whole) * 60);
  const seconds = ((size - whole) * 60 - minutes) * 60;
  return `${String(whole).padStart(2, '0')}:${String(minutes).padStart(2, '0')}:${seconds.toFixed(digits).padStart(3 + digits, '0')}`;
}

export class Readout {
  constructor(app) {
    this.app = app;
    const {canvas, stage, preview} = app;
    canvas.addEventListener('pointermove', (event) => { this.at = [event.clientX, event.clientY]; this.show(); });
    canvas.addEventListener('pointerleave', () => { this.at = null; this.show(); });
    preview.addEventListener('frame', () => this.show());
    stage.ondraw(() => this.drawBar());
    new ResizeObserver(() => this.drawBar()).observe($('colour-bar'));
  }

  show() {
    const {stage, picture, preview, ui} = this.app;
    const pixel = this.at && stage.pixelAt(...this.at);
    if (!pixel || !preview.shown) {
      $('readout').textContent = this.summary();
      return;
    }
    const parts = preview.values(pixel.x, pixel.y).map(({name, value}) => `${name} ${this.number(value)}`);
    const unit = picture.frame.header.planes[0].unit ?? '';
    const [width, height] = preview.size;
    const place = `x ${(pixel.u * width + 0.5).toFixed(1)}  y ${(pixel.v * height + 0.5).toFixed(1)}`;
    $('readout').textContent = `${place}   ${this.where(pixel, ui.camera)}\n${parts.join('   ')} ${unit}`;
  }

  summary() {
    const {picture, preview} = this.app;
    if (!picture.frame) return '';
    const {width, height, milliseconds = 0} = picture.frame.header;
    const [full] = preview.size;
    return `${width} × ${height} pixels${width < full ? ` of ${preview.size.join(' × ')}` : ''}\n${Math.round(milliseconds)} ms`;
  }

  number(value) { return Number.isFinite(value) ? String(Number(value.toPrecision(4))) : 'none'; }

  where(pixel, camera) {
    const sky = skyOf(this.app.picture.frame.header.wcs);
    if (sky) {
      const at = sky(pixel.u * pixel.width + 0.5, pixel.v * pixel.height + 0.5);
      return at ? `ra ${sexagesimal(at.ra / 15, 2)}  dec ${at.dec < 0 ? '−' : '+'}${sexagesimal(at.dec, 1)}` : 'outside the sky';
    }
    const point = pointAt(camera, pixel.dx, pixel.dy);
    return point ? `(${point.map((value) => value.toFixed(3)).join(', ')})` : '';
  }

  drawBar() {
    const {ui, picture} = this.app, bar = $('colour-bar'), box = bar.getBoundingClientRect();
    if (!ui.tone || box.width === 0) return;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [box.width, box.height].map((side) => Math.round(side * ratio)), {tone, look} = ui;
    const unit = picture.frame?.header.planes[0].unit ?? '';
    const key = JSON.stringify([width, height, tone, look, unit]);
    if (key === this.drawn) return;
    this.drawn = key;
    sizeTo(bar, width, height);
    const ink = flatInk(bar);
    ink.clearRect(0, 0, width, height);
    const shape = look.mode === 'lupton' ? 'asinh' : look.mode;
    const gain = 2 ** look.exposure;
    const light = (place) => (lightOf(shape, place ** look.gamma, look.slope, look.white - look.black) + look.black) / gain;
    for (let x = 0; x < width; ++x) {
      const value = light(x / (width - 1));
      const rgb = colour(tone, look, tone.factor.map((factor, c) => value / factor + tone.black[c]));
      ink.fillStyle = `rgb(${rgb.map((part) => Math.round(255 * part)).join()})`;
      ink.fillRect(x, 0, 1, height * 0.45);
    }
    ink.font = `${10 * ratio}px system-ui, sans-serif`;
    ink.fillStyle = '#9a9da3';
    // The ends come first. A number between them is left out where it would touch another one.
    const taken = [];
    for (const place of [0, 1, 1 / 3, 2 / 3]) {
      const value = light(place) / tone.factor[1] + tone.black[1];
      const label = `${text(Number(value.toPrecision(2)))}${place === 1 ? ` ${unit}` : ''}`.trim();
      const wide = ink.measureText(label).width;
      const left = Math.min(Math.max(place * width - wide / 2, 0), width - wide);
      if (taken.some(([from, to]) => left < to + 4 * ratio && left + wide > from - 4 * ratio)) continue;
      taken.push([left, left + wide]);
      ink.fillText(label, left, height - 1.5 * ratio);
    }
  }
}
