// Save, save as, command line, and export of the shown picture.

import {download, h} from './dom.js';
import {ask, confirm, dialog, say} from './messages.js';
import {Outputs} from './outputs.js';
import {cameraSettings} from './view.js';

export class Files {
  constructor(app) { this.app = app; }

  /// Fields of the real job: the view, the galaxies and every setting, without mutes.
  job(extra = {}) {
    const {doc, ui} = this.app;
    return doc.fields({...cameraSettings(ui.camera), ...extra});
  }

  /// Saves the scene's rows where they changed, and the galaxy over its own file. A galaxy of the
  /// catalogue that changed gets a name first.
  async save() {
    const {doc} = this.app;
    if (!doc.isSceneChanged) return this.saveGalaxy();
    if (!await this.saveScene()) return;
    if (doc.text !== doc.saved[doc.chosen]) await this.saveGalaxy();
  }

  async saveScene() {
    const {connection, doc} = this.app, scene = doc.scene;
    try {
      const reply = await connection.request('save_scene', {scene});
      doc.savedScene = scene;
      await doc.refresh(false);
      say(`Saved ${reply.file}.`);
      return true;
    } catch (error) {
      say(`Not saved: ${error.message}`, 'problem');
      return false;
    }
  }

  async saveGalaxy() {
    const {connection, doc} = this.app, galaxy = doc.chosen, text = doc.text;
    if (!doc.opened.own.includes(galaxy)) {
      await this.saveAs();
      return;
    }
    try {
      const reply = await connection.request('save', {galaxy, galaxy_text: text});
      doc.saved[galaxy] = text;
      await doc.refresh(false);
      say(`Saved ${reply.file}.`);
    } catch (error) {
      say(`Not saved: ${error.message}`, 'problem');
    }
  }

  async saveAs() {
    const {connection, doc} = this.app, text = doc.text;
    const name = await ask('Save as', 'Name of the galaxy in the output folder', `my_${doc.chosen}`, 'Save');
    if (!name) return;
    const names = await this.app.outputs.names();
    const fields = {name, galaxy_text: text};
    if (names.includes(name.replace(/(\.toml)?$/, '.toml'))) {
      if (!await confirm('Save as', `${name} is there already.`, 'Replace it')) return;
      fields.overwrite = true;
    }
    try {
      const reply = await connection.request('save_as', fields);
      doc.saved[doc.chosen] = text;
      await doc.refresh(false);
      say(`Saved ${reply.path}.`, 'note', ['Download', () => this.fetchFile(reply.file)]);
    } catch (error) {
      say(`Not saved: ${error.message}`, 'problem');
    }
  }

  fetchFile(file) {
    h('a', {href: Outputs.address(file), download: file}).click();
  }

  async copyCommand() {
    try {
      const reply = await this.app.connection.request('command', this.job());
      await navigator.clipboard.writeText(reply.command).catch(() => null);
      const area = h('textarea', {readOnly: true, rows: 5, value: reply.command, 'aria-label': 'Command line'});
      const unsaved = reply.unsaved?.length ? `Save first: ${reply.unsaved.join(', ')}.` : '';
      dialog('Command line, copied', h('div', {}, h('p', {}, `This makes the picture of the present view. ${unsaved}`), area));
      area.select();
    } catch (error) {
      say(error.message, 'problem');
    }
  }

  /// The picture as it is shown, with stretch and mutes.
  exportShown() {
    const {canvas, picture, ui, doc, stage} = this.app;
    if (!picture.frame) return;
    picture.draw(ui.tone, ui.look, stage.seeing(), null);
    canvas.toBlob((blob) => download(blob, `${doc.chosen}.png`));
    stage.draw();
  }
}
