// "Another one": other seeds for a component or the galaxy, and a sheet of nine variations.

import {h} from './dom.js';
import {dialog, say} from './messages.js';
import {Picture} from './picture.js';
import {cameraSettings} from './view.js';
import {planeWeights} from './channels.js';

const tile = 160, tolerance = 0.05;

const newSeed = () => 1 + Math.floor(Math.random() * 999999);

export class Seeds {
  constructor(app) { this.app = app; }

  /// The key of a component's seed: its own, or that of its noise. Null for smooth ones.
  keyOf(component) {
    const names = this.app.doc.opened.declarations.kinds[component.kind].map(({name}) => name);
    if (names.includes('seed')) return 'seed';
    return names.includes('noise.seed') && component.values.noise !== false ? 'noise.seed' : null;
  }

  /// Another seed for the chosen component.
  async another() {
    const {doc, components} = this.app, component = components.chosen;
    if (!component) return;
    const key = this.keyOf(component);
    if (!key) {
      say(`${component.name} is smooth: it has no seed.`);
      return;
    }
    await doc.edit([{set: [components.index, key, newSeed()]}], `another ${component.name}`);
  }

  /// The choices of what a sheet varies: [key, label].
  subjects() {
    const {components} = this.app;
    const list = [['all', 'Whole galaxy: arms and all noise'], ['arms', 'Course of the arms']];
    for (const [i, component] of components.components.entries()) {
      if (this.keyOf(component)) list.push([String(i), component.name]);
    }
    return list;
  }

  edits(subject, seed) {
    const {components} = this.app;
    if (subject === 'arms') return [{set: [null, 'arms.seed', seed]}];
    const one = (i) => ({set: [i, this.keyOf(components.components[i]), seed + i]});
    if (subject !== 'all') return [one(Number(subject))];
    const seeded = components.components.flatMap((component, i) => this.keyOf(component) ? [one(i)] : []);
    return [{set: [null, 'arms.seed', seed]}, ...seeded];
  }

  sheet() {
    const {components, preview} = this.app;
    const subjects = this.subjects(), own = String(components.index);
    const select = h('select', {'aria-label': 'What varies'}, subjects.map(([key, label]) => h('option', {value: key}, label)));
    select.value = subjects.some(([key]) => key === own) ? own : 'all';
    const grid = h('div', {class: 'sheet'});
    const more = h('button', {type: 'button', class: 'main', onclick: () => this.fill(grid, select.value, close)}, 'Nine others');
    const {box, close} = dialog('Nine variations', h('div', {}, h('div', {class: 'sheet-head'}, h('label', {}, 'Vary ', select), more), grid), 'wide');
    select.addEventListener('change', () => this.fill(grid, select.value, close));
    preview.isPaused = true;
    box.addEventListener('close', () => {
      this.run = null;
      preview.isPaused = false;
      preview.ask(false);
    });
    this.fill(grid, select.value, close);
  }

  async fill(grid, subject, close) {
    const run = this.run = {};
    const {doc} = this.app;
    const seeds = Array.from({length: 9}, newSeed);
    const tiles = seeds.map((seed) => {
      const canvas = h('canvas', {width: tile, height: tile});
      const button = h('button', {type: 'button', class: 'variation', disabled: true, title: `seed ${seed}`,
                                  'aria-label': `Take the variation with seed ${seed}`,
                                  onclick: () => { close(); doc.edit(this.edits(subject, seed), `variation ${seed}`); }},
                       canvas, h('span', {}, String(seed)));
      return {seed, canvas, button};
    });
    grid.replaceChildren(...tiles.map(({button}) => button));
    for (const one of tiles) {
      if (this.run !== run) return;
      try {
        await this.draw(one, this.edits(subject, one.seed));
      } catch (error) {
        if (this.run === run) say(error.message, 'problem');
        return;
      }
      one.button.disabled = false;
      if (one === tiles[0]) one.button.focus();
    }
  }

  async draw({canvas}, edits) {
    const {connection, doc, ui, preview} = this.app;
    const reply = await connection.request('edit', {galaxy_text: doc.text, edits});
    doc.remember(reply.galaxy_text, reply.model);
    const fields = doc.fields(cameraSettings(ui.camera));
    fields.galaxies = {...fields.galaxies, [doc.chosen]: reply.galaxy_text};
    const [width, height, rough] = preview.sized(tile, tolerance);
    const frame = await this.render({...fields, planes: 'image', muted: preview.muted(doc.model, true), sizes: [[width, height, rough]]});
    this.picture ??= new Picture(h('canvas'));
    this.picture.setFrame(frame);
    this.picture.setWeights(planeWeights(frame.header, ui.channels, () => 1));
    this.picture.draw(ui.tone, ui.look);
    [canvas.width, canvas.height] = [width, height];
    canvas.getContext('2d').drawImage(this.picture.canvas, 0, 0);
  }

  render(fields) {
    const {connection} = this.app;
    return new Promise((resolve, reject) => {
      const id = connection.send('view', fields);
      const done = () => {
        connection.removeEventListener('frame', onframe);
        connection.removeEventListener('message', onmessage);
        connection.removeEventListener('lost', onlost);
      };
      const onframe = ({detail}) => { if (detail.header.id === id && detail.header.last && !(detail.header.rows < detail.header.height)) { done(); resolve(detail); } };
      const onmessage = ({detail}) => {
        if (detail.id !== id) return;
        done();
        reject(new Error(detail.message ?? 'the variation was cancelled'));
      };
      const onlost = () => { done(); reject(new Error('the connection was lost')); };
      connection.addEventListener('frame', onframe);
      connection.addEventListener('message', onmessage);
      connection.addEventListener('lost', onlost);
      if (id === 0) onlost();
    });
  }
}
