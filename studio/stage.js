// The canvas in its room: its size, its tone, and when it is drawn again.

import {plainLook} from './stretch.js';
import {seeingOf} from './seeing.js';

// Milliseconds between two drawings of a frame in the making, and where the browser has no fast GPU.
const stripMs = 150, slowStripMs = 600;

export class Stage {
  constructor({room, canvas, picture, preview, ui}) {
    Object.assign(this, {room, canvas, picture, preview, ui});
    this.next = null;  // the drawing before the browser's next frame
    new ResizeObserver(() => this.fit()).observe(room);
    preview.addEventListener('frame', () => this.takeFrame());
    preview.addEventListener('strip', () => this.takeFrame());
    canvas.addEventListener('restored', () => { preview.weigh(); this.draw(); });
    ui.addEventListener('muted', () => { preview.weigh(); this.draw(); });
    ui.addEventListener('look', () => { preview.weigh(); this.take(true); });
    this.listeners = [];
  }

  /// Gives the canvas the image's aspect within its room.
  fit() {
    const [width, height] = this.preview.size;
    const room = this.room.getBoundingClientRect();
    const factor = Math.min((room.width - 2) / width, (room.height - 2) / height);
    const shown = [Math.max(Math.floor(width * factor), 1), Math.max(Math.floor(height * factor), 1)];
    this.canvas.style.width = `${shown[0]}px`;
    this.canvas.style.height = `${shown[1]}px`;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const pixels = shown.map((side) => Math.max(Math.round(side * ratio), 1));
    if (this.picture.room?.join() === pixels.join()) return;
    this.picture.room = pixels;
    this.draw();
  }

  /// Takes a new frame. An unfinished frame is not drawn for each of its strips, which without a
  /// GPU would slow its render down.
  takeFrame() {
    if (this.picture.frame?.header.isPartial && !this.preview.shares) {
      this.strips ??= setTimeout(() => { this.strips = null; this.take(); }, this.draft?.isSlow ? slowStripMs : stripMs);
      return;
    }
    clearTimeout(this.strips);
    this.strips = null;
    this.take();
    // A busy browser shows its next frame late. A picture that is drawn at once appears in it.
    if (this.preview.shown?.moving && !this.draft?.isShown) this.drawNow();
  }

  /// Takes a new frame or look. While something moves the tone stays as it was, without flicker.
  take(force = false) {
    const {ui, preview, picture} = this;
    if (!picture.frame) return;
    const key = `${ui.channels}/${preview.isGrey}`;
    const isNew = !ui.tone || ui.tone.key !== key;
    if (isNew || (ui.look.auto && preview.isFinal && !preview.shares) || (force && ui.look.auto)) {
      ui.tone = {...picture.tone(preview.isGrey, preview.channelFactors), key};
      if (ui.look.auto || isNew) {
        const {slope, white} = plainLook(ui.tone);
        Object.assign(ui.look, {slope, white, black: 0});
      }
    }
    this.fit();
    this.draw();
  }

  /// Draws before the browser's next frame.
  draw() { this.next ??= requestAnimationFrame(() => this.drawNow()); }

  drawNow() {
    cancelAnimationFrame(this.next);
    this.next = null;
    if (!this.ui.tone || !this.picture.frame) return;
    if (this.draft?.isShown) this.draft.draw(this.ui.tone, this.ui.look);
    else this.picture.draw(this.ui.tone, this.ui.look, this.seeing());
    for (const listener of this.listeners) listener();
  }

  /// PSF and noise in the pixels of the frame.
  seeing() { return seeingOf(this.ui.look, this.picture.frame.header.width / this.preview.size[0]); }

  /// Calls a function after each drawing.
  ondraw(listener) { this.listeners.push(listener); }

  /// Pixel of the frame at a place of the window, or null.
  pixelAt(clientX, clientY) {
    const frame = this.picture.frame;
    if (!frame) return null;
    const box = this.canvas.getBoundingClientRect();
    const u = (clientX - box.left) / box.width, v = 1 - (clientY - box.top) / box.height;
    if (u < 0 || v < 0 || u >= 1 || v >= 1) return null;
    const {width, height} = frame.header;
    return {u, v, x: Math.floor(u * width), y: Math.floor(v * height), width, height,
            // from the middle, in units of the width
            dx: u - 0.5, dy: (v - 0.5) * height / width};
  }
}
