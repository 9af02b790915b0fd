// The output folder: its files, and the renders that wait or run.

import {h} from './dom.js';
import {dialog, say} from './messages.js';

const refreshMs = 1000;

function sizeOf(bytes) {
  return bytes < 1e6 ? `${Math.ceil(bytes / 1000)} kB` : `${(bytes / 1e6).toFixed(1)} MB`;
}

export class Outputs {
  constructor(app) { this.app = app; }

  /// Where a file of the folder is downloaded.
  static address(file) { return `/output/${encodeURIComponent(file)}`; }

  async names() {
    const reply = await this.app.connection.request('outputs').catch(() => ({outputs: []}));
    return reply.outputs.map(({name}) => name);
  }

  /// The files that a render of this name made: its file, or the images of a film.
  async madeBy(name) {
    const dot = name.search(/\.(fits(\.fz)?|png|bmp)$/), stem = name.slice(0, dot), suffix = name.slice(dot);
    const isImage = (other) => other.startsWith(`${stem}_`) && other.endsWith(suffix) &&
        /^\d+$/.test(other.slice(stem.length + 1, -suffix.length));
    const names = await this.names();
    return names.includes(name) ? [name] : names.filter(isImage).sort();
  }

  show() {
    const list = h('div', {class: 'outputs'});
    const {box} = dialog('Output folder', list, 'small');
    const refresh = async () => {
      if (!box.open) return;
      try {
        this.fill(list, await this.app.connection.request('outputs'));
      } catch (error) {
        say(error.message, 'problem');
      }
      setTimeout(refresh, refreshMs);
    };
    refresh();
  }

  fill(list, {outputs, jobs}) {
    const key = JSON.stringify([outputs, jobs]);
    if (key === list.dataset.key) return;
    list.dataset.key = key;
    const rows = jobs.map(({id, name, done, total, stage}) => h('div', {class: 'output'},
        h('span', {}, name), h('span', {class: 'note'}, `${stage || 'waits'} ${total > 0 ? `${Math.floor(100 * done / total)} %` : ''}`),
        h('button', {type: 'button', onclick: () => this.app.connection.send('cancel', {target: id})}, 'Cancel')));
    const files = outputs.map(({name, bytes}) => h('div', {class: 'output'},
        h('span', {}, name), h('span', {class: 'note'}, sizeOf(bytes)),
        h('a', {href: Outputs.address(name), download: name}, 'Download')));
    list.replaceChildren(...rows, ...files);
    if (rows.length + files.length === 0) list.replaceChildren(h('p', {class: 'note'}, 'There are no files yet.'));
  }
}
