// The panel of the scene list. It holds only the visible rows, and the columns of the chosen row.

import {h, tool} from './dom.js';
import {ask} from './messages.js';
import {ParameterRow} from './parameter_row.js';
import {columnsOf, rowAfterDelete, rowsOf, valueOf, visibleRows} from './scene_rows.js';

const rowHeight = 24, mostRows = 7;

export class ScenePanel {
  constructor(app) { this.app = app; }

  /// The table of the present scene.
  get table() { return this.tableOf(this.app.doc.scene); }
  get savedTable() { return this.tableOf(this.app.doc.savedScene, 'saved'); }

  tableOf(scene, place = 'shown') {
    const known = this[place];
    return known?.scene === scene ? known.table : (this[place] = {scene, table: rowsOf(scene)}).table;
  }

  get row() { return Math.min(this.app.ui.row, this.table.rows.length - 1); }

  choose(row, focus = false) {
    this.app.ui.row = Math.min(Math.max(row, 0), this.table.rows.length - 1);
    this.reveal();
    this.app.ui.say('selected');
    if (focus) this.list.querySelector('[aria-selected=true]')?.focus();
  }

  /// The galaxy of the chosen row becomes the chosen galaxy where the page has its text.
  async openGalaxy() {
    const {doc} = this.app, name = this.word(this.table, this.row, 'galaxy');
    if (doc.state.galaxies[name] !== undefined && name !== doc.chosen) await doc.choose(name);
  }

  word({columns, rows}, row, column) { return rows[row]?.[columns.indexOf(column)]; }

  /// Builds the panel and returns its rows of parameters.
  build(box) {
    const {doc} = this.app;
    this.inner = h('div', {class: 'scene-inner'});
    this.list = h('div', {class: 'scene-rows', role: 'listbox', tabIndex: 0, 'aria-label': 'Rows of the scene',
                          onscroll: () => this.showRows(), onkeydown: (event) => this.key(event)}, this.inner);
    box.append(h('div', {class: 'tools scene-tools', role: 'toolbar', 'aria-label': 'Rows'},
        tool('add', 'Add a galaxy of the catalogue, like the chosen row', '', () => this.add()),
        tool('clone', 'Clone the row', '', () => this.clone()),
        tool('remove', 'Delete the row', '', () => this.remove()),
        this.count = h('span', {class: 'note'})), this.list);
    const {own, others} = columnsOf(this.table.columns, doc.opened.declarations.scene);
    const group = h('details', {class: 'group'}, h('summary', {}, 'Other columns'));
    const make = (declared, parent) => {
      const words = declared.name === 'galaxy' ? [...new Set([...Object.keys(doc.state.galaxies), ...doc.opened.catalogue.galaxies])] :
          declared.name === 'sed' ? doc.opened.catalogue.seds : null;
      const row = new ParameterRow(declared, this.actions(declared.name), words);
      parent.append(row.element);
      return {row, state: () => this.state(declared)};
    };
    const rows = own.map((declared) => make(declared, box));
    box.append(group);
    return [...rows, ...others.map((declared) => make(declared, group))];
  }

  state({name, type}) {
    const value = valueOf(this.word(this.table, this.row, name), type);
    const saved = this.savedTable;
    // Rows are compared with the saved rows of equal number if both lists have one length.
    const first = saved.rows.length === this.table.rows.length ? valueOf(this.word(saved, this.row, name), type) : value;
    return {value, first, given: value !== null};
  }

  actions(name) {
    const {doc} = this.app;
    const edits = (value) => [{set: [this.row, name, value]}];
    const label = () => `row ${this.row + 1}: ${name}`;
    return {
      preview: (value) => doc.previewScene(edits(value)),
      commit: (value) => doc.editScene(edits(value), label(), `row/${this.row}/${name}`, name === 'galaxy' ? value : null),
      reset: (toNone = false) => {
        const {first, value} = this.state(doc.opened.declarations.scene.find((one) => one.name === name) ?? {name, type: 'text'});
        doc.editScene(edits(toNone || first === value ? null : first), `${label()} reset`);
      },
    };
  }

  async add() {
    const {doc} = this.app;
    const name = await ask('Add a galaxy', 'Galaxy of the catalogue', 'spiral', 'Add', doc.opened.catalogue.galaxies);
    if (!name) return;
    const row = this.row, count = this.table.rows.length;
    await doc.editScene([{add: [row, name]}], `add ${name}`, null, name);
    if (this.table.rows.length > count) this.choose(row + 1);
  }

  async clone() {
    const row = this.row, count = this.table.rows.length;
    await this.app.doc.editScene([{clone: row}], `clone row ${row + 1}`);
    if (this.table.rows.length > count) this.choose(row + 1);
  }

  async remove() {
    const row = this.row, count = this.table.rows.length;
    await this.app.doc.editScene([{delete: row}], `delete row ${row + 1}`);
    if (this.table.rows.length < count) this.choose(rowAfterDelete(row, count));
  }

  key(event) {
    const page = Math.max(Math.floor(this.list.clientHeight / rowHeight) - 1, 1);
    if (event.key === 'Enter') this.openGalaxy();
    const step = {ArrowUp: -1, ArrowDown: 1, PageUp: -page, PageDown: page, Home: -1e9, End: 1e9}[event.key];
    if (event.altKey || event.ctrlKey || (!step && event.key !== 'Delete')) return;
    event.preventDefault();
    event.stopPropagation();
    if (step) this.choose(this.row + step);
    else this.remove();
  }

  reveal() {
    const top = this.row * rowHeight, {scrollTop, clientHeight} = this.list;
    if (top < scrollTop) this.list.scrollTop = top;
    else if (top + rowHeight > scrollTop + clientHeight) this.list.scrollTop = top + rowHeight - clientHeight;
  }

  showRows() {
    const {rows} = this.table;
    this.count.textContent = `row ${this.row + 1} of ${rows.length}`;
    this.list.style.height = `${Math.min(Math.max(rows.length, 2), mostRows) * rowHeight}px`;
    this.inner.style.height = `${rows.length * rowHeight}px`;
    const [first, last] = visibleRows(this.list.scrollTop, this.list.clientHeight || 160, rowHeight, rows.length);
    this.inner.replaceChildren(...rows.slice(first, last).map((_, i) => this.rowElement(first + i)));
  }

  rowElement(row) {
    const {table} = this, word = (column) => this.word(table, row, column) ?? '';
    const id = word('id');
    const element = h('div', {class: 'scene-row', role: 'option', 'aria-selected': String(row === this.row),
                              onclick: () => { this.choose(row); this.openGalaxy(); }},
                      h('span', {class: 'kind'}, String(row + 1)), h('span', {class: 'name'}, word('galaxy')),
                      h('span', {class: 'kind'}, id === '-' ? '' : id));
    element.style.top = `${row * rowHeight}px`;
    return element;
  }
}
