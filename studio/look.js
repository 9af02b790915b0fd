// The dock's page of light: histogram, stretch, exposure, contrast, gamma, saturation, channels.

import {$, choice, h} from './dom.js';
import {Histogram} from './histogram.js';
import {ParameterRow} from './parameter_row.js';
import {spectralPlanes} from './channels.js';
import {plainLook} from './stretch.js';

const stretches = [['lupton', 'Lupton'], ['asinh', 'asinh'], ['log', 'log'], ['linear', 'linear']];
const neutral = {exposure: 0, contrast: 1, gamma: 1, saturation: 1, psf: 0, noise: 0};

const declared = [
  {name: 'exposure', type: 'number', unit: 'stops', min: -8, max: 8, default: 0,
   description: 'factor of the light, powers of 2'},
  {name: 'contrast', type: 'number', unit: '', min: 0.01, max: 100, soft_min: 0.3, soft_max: 10, default: 1, scale: 'log',
   description: 'divides the slope of Lupton\'s stretch; the level 0.28 stays, the brightest parts become white. gamer look has 3'},
  {name: 'gamma', type: 'number', unit: '', min: 0.3, max: 3, default: 1, scale: 'log',
   description: 'exponent 1/gamma of the brightness; 1 as the program\'s pictures'},
  {name: 'saturation', type: 'number', unit: '', min: 0, max: 3, default: 1,
   description: 'distance of the channels from their mean; 0 is grey'},
  {name: 'softness', type: 'number', unit: '', min: 0.1, max: 1e5, soft_min: 1, soft_max: 1e4, default: null,
   scale: 'log', description: 'slope times white of asinh, log and Lupton: larger shows fainter light'},
  {name: 'psf', type: 'number', unit: 'pixels', min: 0, max: 30, soft_max: 12, default: 0,
   description: 'FWHM of a Gaussian point-spread function in pixels of the image, for the eye: gutil convolve --psf gaussian'},
  {name: 'noise', type: 'number', unit: '', min: 0, max: null, default: 0,
   description: 'standard deviation of Gaussian noise in the image\'s unit, for the eye: gutil noise --sigma'},
];

export class LookPanel {
  constructor(app) {
    this.app = app;
    this.histogram = new Histogram(app);
    this.mode = choice('Stretch', stretches, app.ui.look.mode, (mode) => this.set({mode}), 'How light becomes brightness');
    this.auto = h('button', {type: 'button', class: 'chip', title: 'Black, white and softness as the program\'s pictures choose them (U)',
                             onclick: () => this.setAuto(!app.ui.look.auto)}, 'Auto');
    this.neutral = h('button', {type: 'button', class: 'chip', title: 'Back to the program\'s picture', onclick: () => this.back()}, 'Reset');
    this.pixels = h('button', {type: 'button', class: 'chip', title: 'Show pixels as squares (X)', onclick: () => this.togglePixels()}, 'Pixels');
    this.channels = h('span', {class: 'channels'});
    this.rows = declared.map((one) => new ParameterRow(one, {
      preview: (value) => this.put(one.name, value), commit: (value) => this.put(one.name, value),
      reset: () => this.put(one.name, neutral[one.name] ?? plainLook(app.ui.tone).slope * app.ui.tone.white)}));
    $('dock-light').append(this.histogram.element,
        h('div', {class: 'look'}, h('div', {class: 'look-line'}, this.mode, this.auto, this.neutral, this.pixels, this.channels),
          h('div', {class: 'look-rows'}, this.rows.map((row) => row.element))));
    app.ui.addEventListener('look', () => this.show());
    app.preview.addEventListener('frame', () => this.show());
  }

  set(changes) {
    Object.assign(this.app.ui.look, changes);
    this.app.ui.say('look');
  }

  put(name, value) {
    const {look} = this.app.ui;
    if (name === 'softness') this.set({slope: value / look.white, auto: false});
    else this.set({[name]: value});
  }

  setAuto(auto) { this.set({auto}); }
  back() { this.set({...neutral, mode: 'lupton', auto: true}); }
  togglePixels() { this.set({pixels: !this.app.ui.look.pixels}); }

  show() {
    const {look, tone} = this.app.ui;
    if (!tone) return;
    this.mode.value = look.mode;
    this.auto.setAttribute('aria-pressed', String(look.auto));
    this.pixels.setAttribute('aria-pressed', String(look.pixels));
    const values = {...look, softness: Number((look.slope * look.white).toPrecision(4))};
    const first = {...neutral, softness: Number((tone.slope * tone.white).toPrecision(4))};
    for (const row of this.rows) {
      const name = row.declared.name;
      if (name === 'noise') row.declared.soft_max = Number((0.02 * tone.white).toPrecision(2));
      const key = `${values[name]}/${first[name]}/${row.declared.soft_max}`;
      if (key === row.shown && !row.element.contains(document.activeElement)) continue;
      row.shown = key;
      row.show({value: values[name], first: first[name], given: false});
    }
    this.showChannels();
  }

  showChannels() {
    const {ui, picture} = this.app, {header} = picture.frame;
    const names = spectralPlanes(header).map((plane) => plane.label);
    const key = names.join('/');
    if (key !== this.names) {
      this.names = key;
      const options = [['', 'auto'], ...names.map((name) => [name, name])];
      this.selects = ['red', 'green', 'blue'].map((colour, c) =>
          choice(`Plane that is ${colour}`, options, '', (name) => this.choosePlane(c, name), `Plane that is ${colour}`));
      this.selects.forEach((select, c) => select.classList.add(['red', 'green', 'blue'][c]));
      this.channels.replaceChildren(...(names.length > 1 ? this.selects : []));
    }
    const isKnown = ui.channels?.every((name) => names.includes(name));
    this.selects.forEach((select, c) => { select.value = isKnown ? ui.channels[c] : ''; });
  }

  choosePlane(channel, name) {
    const {ui} = this.app;
    if (name === '') ui.channels = null;
    else {
      const names = this.names.split('/');
      ui.channels = ui.channels ? [...ui.channels] : this.autoPlanes(names);
      ui.channels[channel] = name;
    }
    ui.say('look');
  }

  /// A plane for each channel, near those of the automatic choice.
  autoPlanes(names) {
    const planes = spectralPlanes(this.app.picture.frame.header);
    const sorted = planes.every((plane) => plane.wavelength) ?
        [...planes].sort((a, b) => b.wavelength - a.wavelength).map((plane) => plane.label) : names;
    return [sorted[0], sorted[Math.floor(sorted.length / 2)], sorted[sorted.length - 1]];
  }
}
