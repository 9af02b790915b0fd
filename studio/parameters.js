// The right panel: parameters of the chosen component, of the galaxy, and of the render.

import {$, h} from './dom.js';
import {ParameterRow} from './parameter_row.js';
import {shareEdits, valueEdits} from './light.js';
import {ArmTools} from './arms.js';
import {uselessness} from './key_use.js';

const allTabs = [['component', 'Component'], ['galaxy', 'Galaxy'], ['scene', 'Scene'], ['render', 'View']];
const hiddenSections = new Set(['animation', 'catalogue', 'stamps', 'truth']);
const folded = new Set(['photometry', 'cosmology', 'sampling', 'stars', 'scene']);

export class ParameterPanel {
  constructor(app) {
    this.app = app;
    this.rows = [];
    this.built = '';
    const {doc, ui} = app;
    this.arms = new ArmTools(app);
    // One galaxy without a scene has no list.
    this.tabs = allTabs.filter(([key]) => key !== 'scene' || doc.opened.scene_file);
    if (!this.tabs.some(([key]) => key === ui.tab)) ui.tab = 'component';
    $('tabs').append(...this.tabs.map(([key, label]) =>
        h('button', {type: 'button', role: 'tab', id: `tab-${key}`, 'aria-controls': 'parameters',
                     onclick: () => this.choose(key), onkeydown: (event) => this.tabKey(event)}, label)));
    this.search = h('input', {type: 'search', placeholder: 'Find a parameter', 'aria-label': 'Find a parameter',
                              oninput: () => this.filter()});
    this.which = h('button', {type: 'button', class: 'chip', title: 'Only parameters that the file gives or that changed',
                              onclick: () => this.toggleFilter()}, 'In the file');
    $('filters').append(this.search, this.which);
    for (const [target, name] of [[doc, 'change'], [ui, 'selected'], [ui, 'camera']]) {
      target.addEventListener(name, () => this.show());
    }
  }

  choose(tab) {
    this.app.ui.tab = tab;
    this.app.ui.say('panels');
    this.show();
  }

  tabKey(event) {
    const step = {ArrowLeft: -1, ArrowRight: 1}[event.key];
    if (!step) return;
    const {tabs} = this, at = tabs.findIndex(([key]) => key === this.app.ui.tab);
    const [next] = tabs[(at + step + tabs.length) % tabs.length];
    this.choose(next);
    $(`tab-${next}`).focus();
  }

  toggleFilter() {
    this.app.ui.filter = this.app.ui.filter === 'all' ? 'given' : 'all';
    this.filter();
  }

  show() {
    const {doc, ui} = this.app;
    if (!doc.model) return;
    for (const [key] of this.tabs) {
      $(`tab-${key}`).setAttribute('aria-selected', String(key === ui.tab));
      $(`tab-${key}`).tabIndex = key === ui.tab ? 0 : -1;
    }
    $('parameters').setAttribute('aria-labelledby', `tab-${ui.tab}`);
    const component = this.app.components.chosen;
    const {tab} = ui, {scenePanel} = this.app;
    const built = tab === 'component' ? `component/${doc.chosen}/${component?.kind}/${component?.name}` :
        tab === 'scene' ? `scene/${scenePanel.table.columns}` : `${tab}/${doc.chosen}/${doc.model.arms?.length}`;
    if (built !== this.built) this.build(ui.tab, component);
    this.built = built;
    for (const {row, state} of this.rows) row.show(state());
    if (tab === 'scene') scenePanel.showRows();
    this.filter();
  }

  build(tab, component) {
    this.rows = [];
    const box = $('parameters');
    box.replaceChildren();
    box.scrollTop = 0;
    if (tab === 'component') {
      if (component) this.buildComponent(box, component.kind);
    } else if (tab === 'galaxy') {
      this.buildGalaxy(box);
    } else if (tab === 'scene') {
      this.rows = this.app.scenePanel.build(box);
    } else {
      this.buildRender(box);
    }
  }

  group(box, key, title, open = true) {
    const {ui} = this.app;
    const details = h('details', {class: 'group', open: ui.folded[key] === undefined ? open : !ui.folded[key],
                                  ontoggle: () => { ui.folded[key] = !details.open; }},
                      h('summary', {}, title));
    box.append(details);
    return details;
  }

  words(name) {
    const {catalogue} = this.app.doc.opened;
    if (name === 'sed') return catalogue.seds;
    if (name === 'bands' || name === 'reference_band') return catalogue.bands;
    if (name === 'follows' || name === 'solo') return this.app.components.components.map((other) => other.name);
    return null;
  }

  buildComponent(box, kind) {
    const {doc, components} = this.app;
    const groups = new Map();
    for (const declared of doc.opened.declarations.kinds[kind] ?? []) {
      if (declared.name === 'class') continue;
      const [group, short] = declared.name.includes('.') ? declared.name.split('.') : ['', declared.name];
      if (!groups.has(group)) groups.set(group, group === '' ? box : this.group(box, group, group));
      const row = new ParameterRow({...declared, label: short}, this.componentActions(declared.name), this.words(short));
      groups.get(group).append(row.element);
      this.rows.push({row, state: () => {
        const now = components.chosen;
        const first = doc.firstModel?.components.find((other) => other.name === now.name);
        return {value: now.values[declared.name], given: now.given.includes(declared.name),
                first: first ? first.values[declared.name] : now.values[declared.name],
                useless: uselessness(declared, (key) => key in now.values ? now.values[key] : this.galaxyValue(doc.model, key))};
      }});
    }
  }

  componentActions(name) {
    const {doc, components, preview} = this.app;
    const edits = (value) => valueEdits(components.components, components.index, name, value);
    const shares = (value) => shareEdits(components.components, components.index, value);
    const label = () => `${components.chosen.name}: ${name}`;
    return {
      preview: (value) => name === 'fraction' ? preview.showShares(shares(value)) : doc.preview(edits(value)),
      commit: (value) => doc.edit(edits(value), label(), `${components.chosen.name}/${name}`),
      reset: (toDefault = false) => {
        const at = components.index, now = components.chosen;
        const first = doc.firstModel?.components.find((other) => other.name === now.name);
        const isChanged = first && JSON.stringify(first.values[name]) !== JSON.stringify(now.values[name]);
        const goBack = !toDefault && isChanged && first.given.includes(name);
        doc.edit(goBack ? edits(first.values[name]) : [{reset: [at, name]}], `${label()} reset`);
      },
    };
  }

  buildGalaxy(box) {
    const {doc} = this.app, groups = new Map();
    for (const declared of doc.opened.declarations.galaxy) {
      const [section, short] = declared.name.includes('.') ? declared.name.split('.') : ['galaxy', declared.name];
      if (!groups.has(section)) groups.set(section, this.group(box, `galaxy/${section}`, section));
      const row = new ParameterRow({...declared, label: short}, this.galaxyActions(declared.name), this.words(short));
      groups.get(section).append(row.element);
      this.rows.push({row, state: () => {
        const value = doc.model.values[declared.name], first = doc.firstModel?.values[declared.name];
        return {value, first, given: doc.model.given.includes(declared.name),
                useless: uselessness(declared, (other) => this.galaxyValue(doc.model, other))};
      }});
    }
    this.buildArms(box);
  }

  /// Arms of their own, [[arm]]; `model.arms` lists their values.
  buildArms(box) {
    const {doc} = this.app;
    this.arms.head(box);
    doc.model.arms?.forEach((_, i) => {
      const group = this.group(box, `galaxy/arm${i}`, `arm ${i + 1}`, false);
      this.arms.tools(group, i);
      for (const declared of doc.opened.declarations.arm) {
        const key = `arm.${i}.${declared.name}`;
        const row = new ParameterRow(declared, this.galaxyActions(key));
        group.append(row.element);
        const valueOf = (model) => model?.arms?.[i]?.[declared.name];
        this.rows.push({row, state: () => {
          const value = valueOf(doc.model);
          return {value, first: valueOf(doc.firstModel), given: value !== null && value !== undefined};
        }});
      }
    });
  }

  galaxyValue(model, name) {
    if (name === 'arm') return model?.arms?.length ?? 0;
    const [section, i, key] = name.split('.');
    return section === 'arm' ? model?.arms?.[i]?.[key] : model?.values[name];
  }

  galaxyActions(name) {
    const {doc} = this.app;
    return {
      preview: (value) => doc.preview([{set: [null, name, value]}]),
      commit: (value) => doc.edit([{set: [null, name, value]}], name, `galaxy/${name}`),
      reset: (toDefault = false) => {
        const first = this.galaxyValue(doc.firstModel, name), now = this.galaxyValue(doc.model, name);
        const wasGiven = doc.firstModel?.given.includes(name) || (name.startsWith('arm.') && (first ?? null) !== null);
        const goBack = !toDefault && wasGiven && JSON.stringify(first) !== JSON.stringify(now);
        doc.edit([goBack ? {set: [null, name, first]} : {reset: [null, name]}], `${name} reset`);
      },
    };
  }

  buildRender(box) {
    const {doc, ui} = this.app;
    for (const [section, list] of Object.entries(doc.opened.declarations.parameters)) {
      if (hiddenSections.has(section)) continue;
      const group = this.group(box, `render/${section}`, section, !folded.has(section));
      for (const declared of list) {
        const key = `${section}.${declared.name}`;
        if (key === 'image.output') continue;
        const row = new ParameterRow(declared, this.renderActions(section, declared.name), this.words(declared.name));
        group.append(row.element);
        this.rows.push({row, state: () => {
          const first = doc.opened.values?.[key], value = this.renderValue(section, declared.name);
          return {value, first, given: doc.opened.given?.includes(key) || key in doc.state.settings,
                  useless: uselessness(declared, (other) => this.renderValue(section, other))};
        }});
      }
    }
  }

  renderValue(section, name) {
    const {doc, ui} = this.app;
    return section === 'camera' && name in ui.camera ? ui.camera[name] : doc.value(`${section}.${name}`);
  }

  renderActions(section, name) {
    const {doc, ui} = this.app, key = `${section}.${name}`;
    if (section === 'camera' && name in ui.camera) {
      return {
        preview: (value) => ui.setCamera({...ui.camera, [name]: value}, true),
        commit: (value) => ui.setCamera({...ui.camera, [name]: value}, false),
        reset: () => ui.setCamera({...ui.camera, [name]: doc.opened.camera[name]}, false),
      };
    }
    return {
      preview: (value) => doc.previewSettings({[key]: value}),
      commit: (value) => doc.set({[key]: value}, key, `render/${key}`),
      reset: () => doc.set({[key]: null}, `${key} reset`),
    };
  }

  filter() {
    const {ui} = this.app, wanted = this.search.value.trim().toLowerCase();
    this.which.setAttribute('aria-pressed', String(ui.filter === 'given'));
    for (const {row} of this.rows) {
      const {name, description} = row.declared;
      const isFound = wanted === '' || name.includes(wanted) || description.toLowerCase().includes(wanted);
      const classes = row.element.classList;
      const isIn = ui.filter === 'all' || wanted !== '' || classes.contains('given') || classes.contains('changed');
      // A parameter that cannot matter is shown in grey if the file gives it or a search finds it.
      const matters = !row.state.useless || wanted !== '' || row.state.given;
      row.element.hidden = !(isFound && isIn && matters);
    }
    for (const group of $('parameters').querySelectorAll('.group')) {
      group.hidden = ![...group.querySelectorAll('.row')].some((row) => !row.hidden);
    }
  }
}
