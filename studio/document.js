// The edited document: texts of galaxies and the scene, and settings that replace keys of the
// parameter file, with their history. The server turns edits into texts; nothing else changes them.

import {History} from './history.js';
import {hasInclination} from './scene_rows.js';

const mostModels = 400;
const mostExcluded = 40;

/// The reset of the key that a server's message reports as excluded by one of the edits, or null.
export function excludedBy(message, edits) {
  const [, key] = message.match(/'?(\w+)'? (?:needs|belongs to|has no meaning) /) ?? [];
  if (key === undefined) return null;
  for (const {set, reset} of edits) {
    if (reset && reset[1].endsWith(key)) return null;
    if (!set) continue;
    const [index, name] = set;
    const other = name.replace(/\w+$/, key);
    if (other !== name) return {reset: [index, other]};
  }
  return null;
}

/// Events: `change` (detail.moving: true while a slider is dragged), `problem` (detail: a text).
export class StudioDocument extends EventTarget {
  constructor(connection) {
    super();
    this.connection = connection;
    this.models = new Map();   // by text
    this.draft = null;         // a state that is not in the history yet
    this.queue = Promise.resolve();
    this.wanted = null;        // the latest preview that has not been sent
    this.fixed = null;         // the scene whose rows keep their orientation while the camera moves
  }

  /// Begins with the document of the server, or continues a history of the same files.
  async load(opened, kept = null) {
    this.opened = opened;
    this.parameters = opened.parameters;
    this.first = {galaxies: opened.galaxies, settings: {}, scene: opened.scene};
    const known = kept && kept.source === this.source();
    this.history = known ? History.unpack(kept.history) : new History(this.first);
    this.saved = known ? kept.saved : {...opened.galaxies};
    this.savedScene = known ? kept.savedScene : opened.scene;
    this.chosen = known && this.state.galaxies[kept.chosen] !== undefined ? kept.chosen : opened.chosen;
    await this.refresh(false);
  }

  /// The texts that identify the files: a reload continues only with these.
  source() { return JSON.stringify([this.opened.parameters, this.opened.scene, this.opened.chosen]); }

  keep(most) {
    return {source: this.source(), history: this.history.pack(most), saved: this.saved,
            savedScene: this.savedScene, chosen: this.chosen};
  }

  get state() { return this.draft ?? this.history.state; }
  get text() { return this.state.galaxies[this.chosen]; }
  get model() { return this.models.get(this.text); }
  /// The model of the chosen galaxy in the file.
  get firstModel() { return this.models.get(this.saved[this.chosen]); }
  get scene() { return this.state.scene; }
  get isSceneChanged() { return this.scene !== this.savedScene; }
  /// Whether the scene or a galaxy differs from its file. A galaxy of an undone row is in no state,
  /// and counts as unchanged.
  get isChanged() {
    return this.isSceneChanged ||
        Object.entries(this.saved).some(([name, text]) => (this.state.galaxies[name] ?? text) !== text);
  }

  /// Whether a kind of component emits light; the others absorb it.
  isLight(kind) {
    return this.opened.declarations.traits[kind].emits;
  }

  /// Value of a render parameter, with settings.
  value(key) { return this.state.settings[key] ?? this.opened.values?.[key]; }

  async choose(name) {
    this.chosen = name;
    await this.refresh(false);
  }

  async modelOf(text) {
    if (this.models.has(text)) return this.models.get(text);
    const reply = await this.connection.request('model', {galaxy_text: text});
    return this.remember(text, reply.model);
  }

  remember(text, model) {
    this.models.delete(text);
    this.models.set(text, model);
    for (const old of this.models.keys()) {
      if (this.models.size <= mostModels) break;
      this.models.delete(old);
    }
    return model;
  }

  async refresh(moving) {
    try {
      await this.modelOf(this.saved[this.chosen]);
      await this.modelOf(this.text);
    } catch (error) {
      this.problem(error);
      return;
    }
    this.dispatchEvent(new CustomEvent('change', {detail: {moving}}));
  }

  problem(error) {
    this.dispatchEvent(new CustomEvent('problem', {detail: error.message}));
  }

  async apply(edits) {
    const text = this.history.state.galaxies[this.chosen];
    const reply = await this.ask(text, edits);
    this.remember(reply.galaxy_text, reply.model);
    const galaxies = {...this.history.state.galaxies, [this.chosen]: reply.galaxy_text};
    return {...this.history.state, galaxies};
  }

  /// The server's answer to edits. Keys that an edit excludes are reset: another law of the arms
  /// removes the keys of the former law.
  async ask(text, edits) {
    try {
      return await this.connection.request('edit', {galaxy_text: text, edits});
    } catch (error) {
      const excluded = excludedBy(error.message, edits);
      if (excluded === null || edits.length > mostExcluded) throw error;
      return this.ask(text, [excluded, ...edits]);
    }
  }

  /// Edits of the chosen galaxy, as one step of the history.
  edit(edits, label, key = null) { return this.editLater(() => ({edits, label}), key); }

  /// Edits that depend on the galaxy after all earlier edits: `make` returns {edits, label}, or
  /// null for none.
  editLater(make, key = null) {
    this.wanted = null;
    this.queue = this.queue.then(async () => {
      try {
        this.draft = null;
        const made = make();
        if (made === null) return;
        const state = await this.apply(made.edits);
        this.commit(state, made.label, key);
      } catch (error) {
        this.draft = null;
        this.problem(error);
        this.dispatchEvent(new CustomEvent('change', {detail: {moving: false}}));
      }
    });
    return this.queue;
  }

  /// The state with edits of the scene's rows. `galaxies` are texts that join the document.
  async applyScene(edits, galaxies = {}) {
    const state = this.history.state;
    const reply = await this.connection.request('edit_scene', {scene: state.scene, edits});
    return {...state, scene: reply.scene, galaxies: {...state.galaxies, ...galaxies}};
  }

  /// Edits of rows, as one step of the history. `name` is a galaxy of the catalogue that a row names.
  editScene(edits, label, key = null, name = null) {
    this.wanted = null;
    this.queue = this.queue.then(async () => {
      try {
        this.draft = null;
        const galaxies = {};
        if (name !== null && this.history.state.galaxies[name] === undefined &&
            this.opened.catalogue.galaxies.includes(name)) {
          galaxies[name] = (await this.connection.request('galaxy', {galaxy: name})).galaxy_text;
          this.saved[name] ??= galaxies[name];
        }
        this.commit(await this.applyScene(edits, galaxies), label, key);
      } catch (error) {
        this.draft = null;
        this.problem(error);
        this.dispatchEvent(new CustomEvent('change', {detail: {moving: false}}));
      }
    });
    return this.queue;
  }

  /// Gives rows with an inclination the orientation in space that this camera sees, so that another
  /// camera sees them from another side. A list that cannot be edited keeps its inclinations.
  fixOrientations(settings) {
    if (this.scene === this.fixed) return;
    this.fixed = this.scene;
    if (!hasInclination(this.scene)) return;
    this.queue = this.queue.then(async () => {
      const {state} = this.history;
      try {
        const reply = await this.connection.request('fix_orientations', {...this.fields(settings), scene: state.scene});
        this.fixed = reply.scene;
        this.commit({...state, scene: reply.scene}, 'orientation in space');
        this.dispatchEvent(new Event('fixed'));
      } catch (error) {
        this.problem(error);
      }
    });
  }

  /// Shows edits that a moving slider would make. Only the latest waiting preview is made.
  preview(edits) { this.previewLater(() => this.apply(edits)); }
  previewScene(edits) { this.previewLater(() => this.applyScene(edits)); }

  previewLater(make) {
    const is_waiting = this.wanted !== null;
    this.wanted = make;
    if (is_waiting) return;
    this.queue = this.queue.then(async () => {
      const latest = this.wanted;
      this.wanted = null;
      if (latest === null) return;
      try {
        this.draft = await latest();
        this.dispatchEvent(new CustomEvent('change', {detail: {moving: true}}));
      } catch { /* an invalid value of a moving slider; the last picture stays */ }
    });
  }

  /// Sets render parameters, null to return to the file's.
  set(changes, label, key = null) {
    this.queue = this.queue.then(() => {
      const settings = {...this.history.state.settings};
      for (const [name, value] of Object.entries(changes)) {
        if (value === null) delete settings[name];
        else settings[name] = value;
      }
      this.draft = null;
      this.commit({...this.history.state, settings}, label, key);
    });
    return this.queue;
  }

  /// Shows render parameters that a moving slider would set.
  previewSettings(changes) {
    this.draft = {...this.history.state, settings: {...this.history.state.settings, ...changes}};
    this.dispatchEvent(new CustomEvent('change', {detail: {moving: true}}));
  }

  commit(state, label, key) {
    const same = JSON.stringify(state) === JSON.stringify(this.history.state);
    if (!same) this.history.commit(state, label, key);
    this.dispatchEvent(new CustomEvent('change', {detail: {moving: false}}));
  }

  async go(step) {
    await this.queue;
    this.draft = null;
    if (!this.history[step]()) return;
    if (this.text === undefined) this.chosen = this.opened.chosen;
    await this.refresh(false);
  }

  /// The fields of messages that render.
  fields(extra = {}) {
    const settings = {...this.state.settings, ...extra};
    return {parameters: this.parameters, scene: this.scene, galaxies: this.state.galaxies, chosen: this.chosen,
            settings: Object.entries(settings).map(([key, value]) => `${key}=${JSON.stringify(value)}`)};
  }
}
