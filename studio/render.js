// The real job: `gamer` into the output folder, with progress, cancel and resume.

import {h} from './dom.js';
import {confirm, dialog, say} from './messages.js';
import {Outputs} from './outputs.js';

export class RenderDialog {
  constructor(app) {
    this.app = app;
    this.stopped = null;  // the file of a render that was cancelled
  }

  /// Asks for name, size and tolerance; `film` has the number of frames and the settings of a film.
  show(film = null) {
    const {doc, preview} = this.app;
    const [width, height] = preview.size;
    const name = h('input', {type: 'text', id: 'render-name', value: `${doc.chosen}.${film ? 'png' : 'fits'}`, spellcheck: false});
    const size = h('input', {type: 'text', id: 'render-size', value: width === height ? `${width}` : `${width} ${height}`, spellcheck: false});
    const tolerance = h('input', {type: 'text', id: 'render-tolerance', value: String(doc.value('sampling.tolerance') ?? 0.001)});
    const bar = h('progress', {max: 1, value: 0, hidden: true, 'aria-label': 'Progress'}), note = h('span', {class: 'note', role: 'status'});
    const label = film ? `Render ${film.frames} frames` : 'Render';
    const start = h('button', {class: 'main', type: 'submit'}, label);
    const stop = h('button', {type: 'button', disabled: true, onclick: () => this.cancel()}, 'Cancel');
    const form = h('form', {class: 'render'},
        h('label', {for: name.id}, 'File'), name, h('label', {for: size.id}, 'Size, pixels'), size,
        h('label', {for: tolerance.id}, 'Tolerance'), tolerance,
        h('p', {class: 'note'}, 'The suffix of the name chooses the format: .fits, .fits.fz, .png or .bmp. The file has neither the mutes nor the stretch of the page.'),
        bar, note, h('div', {class: 'buttons'}, stop, start));
    dialog(film ? 'Render the film' : 'Render', form, 'small');
    form.addEventListener('submit', async (event) => {
      event.preventDefault();
      const sides = size.value.trim().split(/[\s,x×]+/).map(Number);
      start.disabled = true;
      stop.disabled = false;
      const file = name.value.trim();
      if ((await this.app.outputs.names()).includes(file) && !await confirm('Render', `${file} is there already.`, 'Replace it')) {
        start.disabled = false;
        stop.disabled = true;
        return;
      }
      const isResumed = file === this.stopped;
      await this.render(file, isResumed, {
        'image.size': sides.length === 1 ? [sides[0], sides[0]] : sides,
        'sampling.tolerance': Number(tolerance.value), ...(film?.settings ?? {})}, bar, note);
      start.disabled = false;
      start.textContent = this.stopped === file ? 'Resume' : label;
      stop.disabled = true;
    });
  }

  async render(name, isResumed, settings, bar, note) {
    const {connection} = this.app, started = performance.now();
    note.textContent = 'Starting';
    bar.hidden = false;
    this.stopped = null;
    try {
      const job = connection.request('render', {name, ...(isResumed ? {resume: true} : {overwrite: true}), ...this.app.files.job(settings)},
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
      const files = await this.app.outputs.madeBy(reply.file), [first] = files;
      const text = files.length > 1 ? `${first} and ${files.length - 1} others` : reply.file;
      note.replaceChildren(`${text} in ${seconds} s. `,
                           first ? h('a', {href: Outputs.address(first), download: first}, 'Download') : '');
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

  cancel() { this.app.connection.send('cancel', {target: this.jobId}); }
}
