// The renders that the page asks for: small ones while something moves, then finer ones up to the
// scene's own tolerance. A frame of an older request is never shown after one of a newer request.

import {cameraSettings} from './view.js';
import {channelsOf, planeWeights, spectralPlanes, valuesAt} from './channels.js';
import {shareFactors} from './light.js';
import {channelFactors} from './stretch.js';
import {completed, empty, enlarged, isEnd, putStrip} from './strips.js';

const targetMs = 20;       // of a frame while moving
const leastSide = 48;
const leastChange = 0.15;  // of the side of moving views, relative
// Coarse levels: longer side, tolerance, and the least longer side of a view that has the level.
// There are few, since a level takes time, and strips soon show the fine view.
const levels = [[128, 0.05, 129], [256, 0.02, 1024]];

/// Events: `asked` (a view was asked for), `frame` (a new picture), `strip` (rows of it are new),
/// `busy` (detail: whether a still view is made), `problem` (detail: a text).
export class Preview extends EventTarget {
  constructor({connection, doc, ui, picture}) {
    super();
    Object.assign(this, {connection, doc, ui, picture});
    this.side = 96;
    this.asked = new Map();    // by id
    this.shown = null;         // the request whose frame is shown
    this.flight = null;        // id of a request of a moving view
    this.making = null;        // {frame, isShown, rows} of the level whose strips come
    this.isPending = false;
    this.isBusy = false;
    this.isPaused = false;
    this.shares = null;        // edits of shares that a slider shows
    connection.addEventListener('frame', ({detail}) => this.receive(detail));
    connection.addEventListener('message', ({detail}) => this.fail(detail));
    connection.addEventListener('lost', () => { this.forget(); this.setBusy(false); });
  }

  setBusy(isBusy) {
    if (!isBusy && !this.isBusy) return;
    this.isBusy = isBusy;
    this.dispatchEvent(new CustomEvent('busy', {detail: isBusy}));
  }

  /// Width and height of the real image.
  get size() {
    const size = this.doc.value('image.size') ?? 512;
    return Array.isArray(size) ? (size.length === 1 ? [size[0], size[0]] : size) : [size, size];
  }

  forget() {
    this.asked.clear();
    this.flight = this.making = null;
    this.isPending = false;
  }

  sized(side, tolerance) {
    const [width, height] = this.size, longest = Math.max(width, height);
    const part = Math.min(side, longest) / longest;
    return [Math.max(Math.round(width * part), 1), Math.max(Math.round(height * part), 1), tolerance];
  }

  sizes(moving) {
    if (moving) return [this.sized(Math.min(this.side, this.ui.side), 0.1)];
    const tolerance = this.doc.value('sampling.tolerance') ?? 1e-3;
    const last = this.sized(this.ui.side, null);
    const coarse = levels.filter(([, , least]) => Math.max(last[0], last[1]) >= least)
        .map(([side, rough]) => this.sized(side, Math.max(rough, tolerance)));
    return [...coarse, last];
  }

  /// Components that the server leaves out. Muted light stays in planes of components, and the
  /// picture mutes it.
  muted(model, isWhole) {
    return model.components.flatMap((component, i) =>
        this.ui.isMuted(this.doc.chosen, component.name) &&
        (isWhole || !this.doc.isLight(component.kind)) ? [i] : []);
  }

  /// Whether the frame that is shown has no planes of components.
  get isWhole() { return this.picture.frame?.header.is_whole ?? true; }

  /// Asks for the present view. Moving views wait for the one before.
  ask(moving) {
    if (this.isPaused || !this.connection.isOpen || !this.doc.model) return;
    if (moving && this.flight !== null) {
      this.isPending = true;
      return;
    }
    const model = this.doc.model;
    const request = {moving, model, galaxy: this.doc.chosen, camera: this.ui.camera};
    const id = this.connection.send('view', {
      ...this.doc.fields(cameraSettings(this.ui.camera)), planes: moving ? 'image' : 'components',
      muted: this.muted(model, moving), strips: !moving, sizes: this.sizes(moving)});
    if (id === 0) return;
    this.dispatchEvent(new Event('asked'));
    this.asked.clear();
    this.making = null;
    this.asked.set(id, request);
    request.id = id;
    this.flight = moving ? id : null;
    this.isPending = false;
    this.setBusy(!moving);
  }

  receive(frame) {
    const request = this.asked.get(frame.header.id);
    if (!request) return;
    if (isEnd(frame.header)) {
      // The server drops strips that wait when the page asks for something else.
      if (this.making?.rows !== frame.header.height) {
        this.finish(request);
        this.ask(false);
        return;
      }
      frame = completed(this.making.frame, frame.header);
    } else if ((frame.header.rows ?? frame.header.height) < frame.header.height) {
      this.receiveStrip(request, frame);
      return;
    }
    this.making = null;
    this.shown = request;
    this.isFinal = frame.header.last && !request.moving;
    this.shares = null;
    if (frame !== this.picture.frame) this.picture.setFrame(frame, request.moving || !frame.header.last);
    this.weigh();
    if (request.moving) this.adapt(frame.header.milliseconds);
    if (frame.header.last) this.finish(request);
    this.dispatchEvent(new Event('frame'));
  }

  /// Keeps rows of a level that is being made. Shows them over the coarser frame of the same
  /// request, if that frame has the same planes.
  receiveStrip(request, strip) {
    const {picture} = this;
    if (!this.making) {
      const coarse = this.shown === request && picture.frame ? enlarged(strip.header, picture.frame) : null;
      this.making = {frame: coarse ?? empty(strip.header), isShown: coarse !== null, rows: 0};
    }
    const {frame, isShown} = this.making;
    putStrip(frame, strip);
    this.making.rows += strip.header.rows;
    if (!isShown) return;
    this.isFinal = false;
    if (picture.frame === frame) {
      picture.setRows(strip);
    } else {
      picture.setFrame(frame);
      this.weigh();
    }
    this.dispatchEvent(new Event('strip'));
  }

  adapt(milliseconds) {
    const factor = Math.sqrt(targetMs / Math.max(milliseconds, 1));
    // New textures cost more than a small change of the side saves.
    if (Math.abs(factor - 1) < leastChange) return;
    const side = Math.round(this.side * Math.min(Math.max(factor, 0.7), 1.25));
    this.side = Math.min(Math.max(side, leastSide), this.ui.side);
  }

  finish(request) {
    this.asked.delete(request.id);
    this.making = null;
    if (this.flight === request.id) this.flight = null;
    this.setBusy(false);
    if (this.isPending) this.ask(true);
  }

  fail(message) {
    const request = this.asked.get(message.id);
    if (!request) return;
    this.finish(request);
    if (message.op === 'error' && !request.moving) {
      this.dispatchEvent(new CustomEvent('problem', {detail: message.message}));
    }
  }

  cancel() {
    this.connection.send('cancel');
    this.forget();
    this.setBusy(false);
  }

  /// Shows other shares of light in the shown frame, without a render.
  showShares(edits) {
    // A frame that is older than an added or moved component keeps its shares.
    const names = (model) => model?.components.map((component) => component.name).join('/');
    if (!this.shown || names(this.shown.model) !== names(this.doc.model)) return;
    this.shares = edits;
    this.weigh();
    this.dispatchEvent(new Event('frame'));
  }

  /// Factor of the light of component `i` of the frame.
  share(i) {
    const component = this.shown.model.components[i];
    if (!component) return 1;
    if (this.ui.isMuted(this.shown.galaxy, component.name)) return 0;
    return this.factors?.[i] ?? 1;
  }

  weigh() {
    if (!this.shown) return;
    const model = this.shown.model;
    this.factors = null;
    if (this.shares) {
      const after = model.components.map((component) => ({values: {...component.values}}));
      for (const {set: [i, , value]} of this.shares) after[i].values.fraction = value;
      this.factors = shareFactors(model.components, after);
    }
    const {header} = this.picture.frame;
    this.picture.setWeights(planeWeights(header, this.ui.channels, (i) => this.share(i)));
    const channels = channelsOf(header, this.ui.channels);
    this.isGrey = channels.isGrey;
    this.channelFactors = channelFactors(spectralPlanes(header), channels.weights);
  }

  /// Values of the planes under a pixel.
  values(x, y) { return valuesAt(this.picture.frame, x, y, (i) => this.share(i)); }
}
