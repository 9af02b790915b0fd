// Puts the page together.

import {$, h, tool} from './dom.js';
import {Connection} from './connection.js';
import {StudioDocument} from './document.js';
import {UiState, restore, store} from './ui_state.js';
import {Picture} from './picture.js';
import {Preview} from './preview.js';
import {Stage} from './stage.js';
import {Draft} from './draft.js';
import {Navigation} from './navigation.js';
import {ComponentPanel} from './components.js';
import {ParameterPanel} from './parameters.js';
import {ScenePanel} from './scene_panel.js';
import {LookPanel} from './look.js';
import {Readout} from './readout.js';
import {Seeds} from './seeds.js';
import {Files} from './files.js';
import {Outputs} from './outputs.js';
import {RenderDialog} from './render.js';
import {TimeLine} from './timeline.js';
import {Keyboard} from './keyboard.js';
import {say} from './messages.js';

const storeMs = 400;
const patienceMs = 1500;  // without a frame
const sides = [256, 512, 1024, 2048];

const connection = new Connection();
let app = null;

connection.addEventListener('open', async () => {
  showConnection(true);
  try {
    if (app) {
      app.preview.forget();
      app.preview.ask(false);
    } else {
      await begin(await connection.request('open'));
    }
  } catch (error) {
    say(error.message, 'problem');
  }
});
connection.addEventListener('lost', ({detail}) => showConnection(false, detail));
connection.connect();

function showConnection(isOpen, isInvalid = false) {
  $('connection').textContent = isOpen ? 'connected' : 'connection lost';
  $('connection').className = isOpen ? 'open' : 'lost';
  $('lost').hidden = isOpen;
  $('lost').textContent = isInvalid ?
      'This page\'s key is no longer valid: open the address that gstudio printed. Your edits are kept in this tab.' :
      'The connection to gstudio is lost. Your edits are kept; the page comes back by itself.';
}

async function begin(opened) {
  const kept = restore();
  const doc = new StudioDocument(connection);
  doc.addEventListener('problem', ({detail}) => say(detail, 'problem'));
  await doc.load(opened, kept?.document);
  const isSame = kept && kept.document.source === doc.source();
  const ui = new UiState(opened.camera, isSame ? kept.ui : null);
  const canvas = $('picture');
  const picture = new Picture(canvas);
  const preview = new Preview({connection, doc, ui, picture});
  const stage = new Stage({room: $('stage'), canvas, picture, preview, ui});
  const draft = new Draft({connection, doc, ui, picture, preview, stage});
  app = {connection, doc, ui, canvas, picture, preview, stage, draft};
  globalThis.studio = app;  // for the console and tests
  app.navigation = new Navigation({canvas, stage, doc, ui, preview, home: () => opened.camera});
  app.seeds = new Seeds(app);
  app.files = new Files(app);
  app.outputs = new Outputs(app);
  app.renders = new RenderDialog(app);
  app.components = new ComponentPanel(app);
  app.scenePanel = new ScenePanel(app);
  app.parameters = new ParameterPanel(app);
  app.look = new LookPanel(app);
  app.readout = new Readout(app);
  app.timeline = new TimeLine(app);
  buildTools();
  buildPanels();
  followChanges();
  app.components.show();
  app.parameters.show();
  preview.ask(false);
}

function followChanges() {
  const {doc, ui, preview, picture, draft} = app;
  doc.addEventListener('fixed', () => {
    say('The rows of the scene now have their orientation in space (ox oy oz) instead of an inclination towards the camera.');
  });
  doc.addEventListener('change', ({detail}) => { preview.ask(detail.moving); later(); });
  ui.addEventListener('camera', ({detail}) => {
    if (!detail.moving || !draft.show()) preview.ask(detail.moving);
    later();
  });
  // The picture mutes light by itself. Muted dust changes the light, and needs a new view.
  let dust = '';
  ui.addEventListener('muted', () => {
    const muted = preview.muted(doc.model, false).join();
    if (muted !== dust || preview.isWhole) preview.ask(false);
    dust = muted;
    later();
  });
  for (const name of ['look', 'panels', 'selected', 'keys']) ui.addEventListener(name, later);
  preview.addEventListener('problem', ({detail}) => say(detail, 'problem'));
  let patience = null;
  preview.addEventListener('busy', ({detail}) => {
    $('stage').classList.toggle('busy', detail);
    clearTimeout(patience);
    if (detail) patience = setTimeout(() => { $('stage-note').textContent = 'Measuring the galaxies …'; }, patienceMs);
    else if (!picture.frame) $('stage-note').textContent = '';
  });
  preview.addEventListener('frame', () => {
    clearTimeout(patience);
    $('stage-note').textContent = (picture.frame.header.warnings ?? []).join(' ');
  });
  addEventListener('pagehide', () => store(doc, ui));
}

let timer = null;
function later() {
  clearTimeout(timer);
  timer = setTimeout(() => store(app.doc, app.ui), storeMs);
}

function buildTools() {
  const {doc, files, renders, seeds} = app;
  const undo = tool('undo', 'Undo', 'Ctrl+Z', () => doc.go('undo'));
  const redo = tool('redo', 'Redo', 'Ctrl+Shift+Z', () => doc.go('redo'));
  const side = h('select', {id: 'side', title: 'Longer side of the preview, pixels', 'aria-label': 'Preview size',
                            onchange: () => { app.ui.side = Number(side.value); app.preview.ask(false); later(); }},
                 sides.map((pixels) => h('option', {value: pixels}, `${pixels} px`)));
  side.value = app.ui.side;
  $('tools').append(undo, redo, h('span', {id: 'step', class: 'note'}), h('span', {class: 'gap'}),
      tool('dice', 'Another galaxy: other seeds for all of it', 'Shift+N', () => anotherGalaxy()),
      h('span', {class: 'rule'}), side,
      tool('copy', 'Copy as command line', 'Ctrl+Shift+C', () => files.copyCommand(), 'Command'),
      tool('picture', 'Export the picture that is shown as PNG', 'E', () => files.exportShown(), 'PNG'),
      tool('save', 'Save the galaxy', 'Ctrl+S', () => files.save(), 'Save'),
      tool('save', 'Save the galaxy as', 'Ctrl+Shift+S', () => files.saveAs(), 'Save as'),
      tool('folder', 'Files and renders of the output folder', 'O', () => app.outputs.show()),
      tool('render', 'Render to a file', 'R', () => renders.show(), 'Render'));
  $('tools').lastChild.classList.add('main');
  const show = () => {
    undo.disabled = !doc.history.canUndo;
    redo.disabled = !doc.history.canRedo;
    $('step').textContent = doc.history.undoLabel;
    undo.title = `Undo ${doc.history.undoLabel} (Ctrl+Z)`;
    redo.title = `Redo ${doc.history.redoLabel} (Ctrl+Shift+Z)`;
  };
  doc.addEventListener('change', show);
  show();
  app.keyboard = new Keyboard(commands(seeds));
}

function anotherGalaxy() {
  const seed = 1 + Math.floor(Math.random() * 999999);
  app.doc.edit(app.seeds.edits('all', seed), `another galaxy, seed ${seed}`);
}

function buildPanels() {
  const {ui} = app;
  const panel = (name, label, key) => tool(name, label, key, () => toggle(name));
  const left = panel('left', 'Left panel', '['), right = panel('right', 'Right panel', ']');
  $('bar-tools').append(
      tool('centre', 'View of the file', '0', () => app.navigation.goHome()), left, right,
      tool('help', 'Keys', '?', () => app.keyboard.help()));
  const docks = [['light', 'Light'], ['time', 'Time line']].map(([key, label]) => {
    const tab = h('button', {type: 'button', role: 'tab', 'aria-controls': `dock-${key}`,
                             onclick: () => { ui.dock = ui.dock === key ? '' : key; ui.say('panels'); }}, label);
    $('dock-tabs').append(tab);
    return {key, tab};
  });
  const show = () => {
    $('room').classList.toggle('no-left', !ui.left);
    $('room').classList.toggle('no-right', !ui.right);
    left.setAttribute('aria-pressed', String(ui.left));
    right.setAttribute('aria-pressed', String(ui.right));
    for (const {key, tab} of docks) {
      tab.setAttribute('aria-selected', String(ui.dock === key));
      $(`dock-${key}`).hidden = ui.dock !== key;
    }
    app.stage.fit();
  };
  ui.addEventListener('panels', show);
  show();
}

function toggle(panel) {
  app.ui[panel] = !app.ui[panel];
  app.ui.say('panels');
}

function commands(seeds) {
  const {doc, files, renders, components, navigation, timeline, look} = app;
  return [
    ['Edit', ['Ctrl+Z'], 'Undo', () => doc.go('undo')],
    ['Edit', ['Ctrl+Shift+Z', 'Ctrl+Y'], 'Redo', () => doc.go('redo')],
    ['Edit', ['Ctrl+S'], 'Save the galaxy', () => files.save()],
    ['Edit', ['Ctrl+Shift+S'], 'Save the galaxy as', () => files.saveAs()],
    ['Edit', ['Ctrl+Shift+C'], 'Copy as command line', () => files.copyCommand()],
    ['Edit', ['R'], 'Render to a file', () => renders.show()],
    ['Edit', ['O'], 'Files and renders of the output folder', () => app.outputs.show()],
    ['Edit', ['E'], 'Export the shown picture as PNG', () => files.exportShown()],
    ['Components', ['A'], 'Add a component', () => components.showKinds()],
    ['Components', ['D'], 'Clone', () => components.clone()],
    ['Components', ['Delete'], 'Delete', () => components.remove()],
    ['Components', ['M'], 'Mute', () => components.mute()],
    ['Components', ['S'], 'Solo', () => components.solo()],
    ['Components', ['Alt+Up'], 'Move up', () => components.move(-1)],
    ['Components', ['Alt+Down'], 'Move down', () => components.move(1)],
    ['Components', ['N'], 'Another one: another seed', () => seeds.another()],
    ['Components', ['Shift+N'], 'Another galaxy', () => anotherGalaxy()],
    ['Components', ['V'], 'Sheet of nine variations', () => seeds.sheet()],
    ['Components', ['PageUp'], 'Component above', () => components.select(components.index - 1)],
    ['Components', ['PageDown'], 'Component below', () => components.select(components.index + 1)],
    ['View', ['+', '='], 'Zoom in', () => navigation.zoomBy(1 / 1.2)],
    ['View', ['-'], 'Zoom out', () => navigation.zoomBy(1.2)],
    ['View', ['Q'], 'Roll left', () => navigation.rollBy(0.07)],
    ['View', ['W'], 'Roll right', () => navigation.rollBy(-0.07)],
    ['View', ['0'], 'View of the file', () => navigation.goHome()],
    ['View', ['1'], 'Face-on', () => navigation.faceOn()],
    ['View', ['2'], 'Edge-on', () => navigation.edgeOn()],
    ['View', ['3'], 'Oblique', () => navigation.oblique()],
    ['Light', ['U'], 'Automatic stretch', () => look.setAuto(!app.ui.look.auto)],
    ['Light', ['X'], 'Pixels as squares', () => look.togglePixels()],
    ['Time line', ['K'], 'Key frame of the present view', () => timeline.add()],
    ['Time line', ['Space'], 'Play and stop', () => timeline.toggle()],
    ['Page', ['['], 'Left panel', () => toggle('left')],
    ['Page', [']'], 'Right panel', () => toggle('right')],
    ['Page', ['/'], 'Find a parameter', () => app.parameters.search.focus()],
    ['Page', ['C'], 'To the components', () => components.select(components.index, true)],
    ['Page', ['P'], 'To the picture', () => app.canvas.focus()],
    ['Page', ['?'], 'Keys', () => app.keyboard.help()],
  ];
}
