// The left panel: galaxies of the scene and components of the chosen one.

import {$, h, tool} from './dom.js';
import {dialog} from './messages.js';
import {shareEdits, sharing} from './light.js';

export class ComponentPanel {
  constructor(app) {
    this.app = app;
    const {doc, ui} = app;
    $('galaxy').addEventListener('change', () => doc.choose($('galaxy').value));
    $('component-tools').append(
        tool('add', 'Add a component', 'A', () => this.showKinds()),
        tool('clone', 'Clone the component', 'D', () => this.clone()),
        tool('remove', 'Delete the component', 'Delete', () => this.remove()),
        tool('up', 'Move the component up', 'Alt+Up', () => this.move(-1)),
        tool('down', 'Move the component down', 'Alt+Down', () => this.move(1)),
        tool('dice', 'Another one: another seed for the component', 'N', () => app.seeds.another()),
        tool('sheet', 'Sheet of nine variations', 'V', () => app.seeds.sheet()));
    doc.addEventListener('change', () => this.show());
    ui.addEventListener('muted', () => this.show());
    ui.addEventListener('selected', () => this.show());
  }

  get components() { return this.app.doc.model?.components ?? []; }

  /// Index of the chosen component.
  get index() {
    const name = this.app.ui.selected[this.app.doc.chosen];
    const found = this.components.findIndex((component) => component.name === name);
    return found < 0 ? 0 : found;
  }

  get chosen() { return this.components[this.index] ?? null; }

  select(index, focus = false) {
    const component = this.components[Math.min(Math.max(index, 0), this.components.length - 1)];
    if (!component) return;
    this.app.ui.selected[this.app.doc.chosen] = component.name;
    this.app.ui.say('selected');
    if (focus) $('components').children[this.index]?.querySelector('.pick').focus();
  }

  /// Chooses a component and shows its parameters.
  open(index, focus = false) {
    this.select(index, focus);
    if (this.app.ui.tab !== 'component') this.app.parameters.choose('component');
  }

  show() {
    const {doc, ui} = this.app;
    this.showGalaxies();
    const list = $('components'), shown = this.components;
    const hadFocus = list.contains(document.activeElement) ? document.activeElement.dataset.role : null;
    const most = Math.max(...sharing(shown).map((i) => shown[i].values.fraction), 1e-9);
    list.replaceChildren(...shown.map((component, i) => this.row(component, i, most)));
    if (hadFocus) list.children[this.index]?.querySelector(`[data-role=${hadFocus}]`)?.focus();
    const sum = sharing(shown).reduce((total, i) => total + shown[i].values.fraction, 0);
    $('light-sum').textContent = shown.length === 0 ? 'No component yet: add one with A.' :
        sum > 0 ? `Shares of light sum to ${Number(sum.toFixed(3))}.` : '';
    $('title').textContent = `${doc.model?.values?.['galaxy.name'] || doc.chosen}${doc.isChanged ? ' — edited' : ''}`;
    document.title = `${doc.isChanged ? '• ' : ''}${doc.chosen} – gstudio`;
    ui.say('shown');
  }

  showGalaxies() {
    const {doc} = this.app, names = Object.keys(doc.state.galaxies);
    if ($('galaxy').dataset.names !== names.join('/')) {
      $('galaxy').replaceChildren(...names.map((name) => h('option', {value: name}, name)));
      $('galaxy').dataset.names = names.join('/');
    }
    $('galaxy').value = doc.chosen;
  }

  row(component, i, most) {
    const {doc, ui} = this.app, name = component.name;
    const isChosen = i === this.index, isMuted = ui.isMuted(doc.chosen, name);
    const isSolo = ui.solo[doc.chosen] === name;
    const share = component.values.fraction;
    const pick = h('button', {type: 'button', class: 'pick', 'aria-current': isChosen ? 'true' : null,
                              'data-role': 'pick', tabIndex: isChosen ? 0 : -1,
                              onclick: () => this.open(i), onkeydown: (event) => this.key(event, i)},
                   h('span', {class: 'name'}, name), h('span', {class: 'kind'}, component.kind));
    if (typeof share === 'number') {
      const bar = h('span', {class: 'share', title: `share of the light ${share}`});
      bar.style.width = `${100 * Math.sqrt(share / most)}%`;
      pick.append(bar);
    }
    const toggle = (text, label, on, run) =>
        h('button', {type: 'button', class: `toggle ${text}`, 'aria-pressed': String(on), title: label,
                     'aria-label': `${label}: ${name}`, 'data-role': text, tabIndex: isChosen ? 0 : -1,
                     onclick: () => { this.select(i); run(); }}, text);
    const row = h('li', {class: `component${isChosen ? ' chosen' : ''}${isMuted ? ' muted' : ''}`,
                         draggable: true}, pick,
                  toggle('M', 'Mute (M)', isMuted && !isSolo && !ui.solo[doc.chosen], () => ui.toggleMute(doc.chosen, name)),
                  toggle('S', 'Solo (S)', isSolo, () => ui.toggleSolo(doc.chosen, name)));
    row.addEventListener('dragstart', (event) => event.dataTransfer.setData('text/plain', String(i)));
    row.addEventListener('dragover', (event) => event.preventDefault());
    row.addEventListener('drop', (event) => {
      event.preventDefault();
      const from = Number(event.dataTransfer.getData('text/plain'));
      this.moveTo(() => [from, i]);
    });
    return row;
  }

  key(event, i) {
    const step = {ArrowUp: -1, ArrowDown: 1}[event.key];
    if (!step || event.altKey) return;
    event.preventDefault();
    this.select(i + step, true);
  }

  mute() { if (this.chosen) this.app.ui.toggleMute(this.app.doc.chosen, this.chosen.name); }
  solo() { if (this.chosen) this.app.ui.toggleSolo(this.app.doc.chosen, this.chosen.name); }

  async remove() {
    let at = 0;
    await this.app.doc.editLater(() => {
      at = this.index;
      const gone = this.chosen, left = this.components.filter((_, i) => i !== at);
      return gone && {edits: [{delete: at}, ...shareEdits(left, null)], label: `delete ${gone.name}`};
    });
    this.select(at);
  }

  async clone() {
    let at = 0;
    await this.app.doc.editLater(() => {
      at = this.index;
      const of = this.chosen;
      const copies = [...this.components.slice(0, at + 1), of, ...this.components.slice(at + 1)];
      return of && {edits: [{clone: at}, ...shareEdits(copies, null)], label: `clone ${of.name}`};
    });
    this.select(at + 1);
  }

  move(step) { return this.moveTo(() => [this.index, this.index + step]); }

  /// Moves a component; `places` gives its index and the new one.
  async moveTo(places) {
    let to = this.index;
    await this.app.doc.editLater(() => {
      const [from, place] = places();
      if (from === place || place < 0 || place >= this.components.length) return null;
      to = place;
      return {edits: [{move: [from, to]}], label: `move ${this.components[from].name}`};
    });
    this.select(to);
  }

  async add(kind) {
    const {doc} = this.app;
    await doc.editLater(() => {
      const before = this.components, added = {values: {fraction: 0.1}, given: ['fraction']};
      const shares = doc.isLight(kind) ?
          shareEdits([...before, added], before.length, sharing(before).length ? 0.1 : 1) : [];
      return {edits: [{add: kind}, ...shares], label: `add ${kind}`};
    });
    this.open(this.components.length - 1, true);
  }

  showKinds() {
    const {declarations} = this.app.doc.opened;
    const list = h('div', {class: 'kinds'});
    const {close} = dialog('Add a component', list);
    for (const kind of Object.keys(declarations.kinds)) {
      const isLight = this.app.doc.isLight(kind);
      list.append(h('button', {type: 'button', class: 'kind-button', onclick: () => { close(); this.add(kind); }},
                    h('strong', {}, kind), h('em', {}, isLight ? 'light' : 'dust'),
                    h('span', {}, declarations.traits[kind].description)));
    }
    list.firstChild?.focus();
  }
}
