// Save, save as, command line, render and export.

import {download, h} from './dom.js';
import {ask, confirm, dialog, say} from './messages.js';
import {cameraSettings} from './view.js';

export class Files {
  constructor(app) { this.app = app; }

  /// Fields of the real job: the view, the galaxies and every setting, without mutes.
  job(extra = {}) {
    const {doc, ui} = this.app;
    return doc.fields({...cameraSettings(ui.camera), ...extra});
  }

  /// Saves over the galaxy's own file; a galaxy of the catalogue gets a name first.
  async save() {
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
    const names = await this.outputs();
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

  /// Names of the files in the output folder.
  async outputs() {
    const reply = await this.app.connection.request('outputs').catch(() => ({outputs: []}));
    return reply.outputs.map(({name}) => name);
  }

  fetchFile(file) {
    h('a', {href: `/output/${encodeURIComponent(file)}`, download: file}).click();
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
    const {width, height} = picture.frame.header, before = [canvas.width, canvas.height];
    [canvas.width, canvas.height] = [width, height];
    picture.draw(ui.tone, ui.look, stage.seeing());
    canvas.toBlob((blob) => {
      download(blob, `${doc.chosen}.png`);
      [canvas.width, canvas.height] = before;
      stage.draw();
    });
  }

  /// The dialog of the real job.
  showRender(film = null) {
    const {doc, preview} = this.app;
    const [width, height] = preview.size;
    const name = h('input', {type: 'text', id: 'render-name', value: `${doc.chosen}.${film ? 'png' : 'fits'}`, spellcheck: false});
    const size = h('input', {type: 'text', id: 'render-size', value: width === height ? `${width}` : `${width} ${height}`, spellcheck: false});
    const tolerance = h('input', {type: 'text', id: 'render-tolerance', value: String(doc.value('sampling.tolerance') ?? 0.001)});
    const bar = h('progress', {max: 1, value: 0, 'aria-label': 'Progress'}), note = h('span', {class: 'note', role: 'status'});
    const start = h('button', {class: 'main', type: 'submit'}, film ? `Render ${film.frames} frames` : 'Render');
    const stop = h('button', {type: 'button', disabled: true, onclick: () => this.cancelRender()}, 'Cancel');
    const form = h('form', {class: 'render'},
        h('label', {for: name.id}, 'File'), name, h('label', {for: size.id}, 'Size, pixels'), size,
        h('label', {for: tolerance.id}, 'Tolerance'), tolerance,
        h('p', {class: 'note'}, 'The name\'s suffix decides: .fits, .fits.fz, .png. Mutes and the stretch of the page do not count.'),
        bar, note, h('div', {class: 'buttons'}, stop, start));
    dialog(film ? 'Render the film' : 'Render', form, 'small');
    form.addEventListener('submit', async (event) => {
      event.preventDefault();
      const sides = size.value.trim().split(/[\s,x×]+/).map(Number);
      start.disabled = true;
      stop.disabled = false;
      const file = name.value.trim();
      if ((await this.outputs()).includes(file) && !await confirm('Render', `${file} is there already.`, 'Replace it')) {
        start.disabled = false;
        stop.disabled = true;
        return;
      }
      const isResumed = file === this.stopped;
      await this.render(file, isResumed, {
        'image.size': sides.length === 1 ? [sides[0], sides[0]] : sides,
        'sampling.tolerance': Number(tolerance.value), ...(film?.settings ?? {})}, bar, note);
      start.disabled = false;
      start.textContent = this.stopped === file ? 'Resume' : 'Render';
      stop.disabled = true;
    });
  }

  async render(name, isResumed, settings, bar, note) {
    const {connection} = this.app, started = performance.now();
    note.textContent = 'Starting';
    this.stopped = null;
    try {
      const job = connection.request('render', {name, ...(isResumed ? {resume: true} : {overwrite: true}), ...this.job(settings)},
                                     (message) => this.showProgress(message, bar, note));
      this.jobId = job.id;
      const reply = await job;
      if (reply.op === 'cancelled') {
        note.textContent = 'Cancelled.';
        this.stopped = name;
        bar.value = 0;
        return;
      }
      bar.value = 1;
      const seconds = ((performance.now() - started) / 1000).toFixed(1);
      const files = reply.files ?? [reply.file];
      note.replaceChildren(`${files.length > 1 ? `${files.length} files` : files[0]} in ${seconds} s. `,
                           h('a', {href: `/output/${encodeURIComponent(files[0])}`, download: files[0]}, 'Download'));
    } catch (error) {
      note.textContent = error.message;
      bar.value = 0;
    }
  }

  showProgress({op, stage, done, total, left, level, text}, bar, note) {
    if (op === 'log') {
      if (level === 'warning') say(text);
      return;
    }
    bar.value = total > 0 ? done / total : 0;
    const percent = total > 0 ? ` ${Math.floor(100 * done / total)} %` : '';
    note.textContent = `${stage}${percent}${left > 1 ? `, ${Math.round(left)} s left` : ''}`;
  }

  cancelRender() { this.app.connection.send('cancel', {target: this.jobId}); }
}
