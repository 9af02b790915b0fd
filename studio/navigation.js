// Camera by mouse, touch and keys: drag orbits, Shift-drag pans, the wheel zooms, a double click
// centres; two fingers pan and zoom.

import {alongPole, cameraSettings, centre, isFlat, isSky, lookFrom, orbit, pan, roll, turnsGalaxies, zoom, zoomAt} from './view.js';
import {poleOf} from './scene_rows.js';

const turnPerWidth = Math.PI;      // radians for a drag across the picture
const settleMs = 220;

export class Navigation {
  constructor({canvas, stage, doc, ui, preview, home}) {
    Object.assign(this, {canvas, stage, doc, ui, preview, home});
    this.pointers = new Map();
    canvas.addEventListener('pointerdown', (event) => this.down(event));
    canvas.addEventListener('pointermove', (event) => this.move(event));
    for (const name of ['pointerup', 'pointercancel']) canvas.addEventListener(name, (event) => this.up(event));
    canvas.addEventListener('wheel', (event) => this.wheel(event), {passive: false});
    canvas.addEventListener('dblclick', (event) => this.centreOn(event));
    canvas.addEventListener('keydown', (event) => this.key(event));
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  }

  get pixels() { return this.preview.size[0]; }

  /// Shows a camera in motion; it settles when nothing follows.
  go(camera, settle = true) {
    if (turnsGalaxies(this.ui.camera, camera)) this.doc.fixOrientations(cameraSettings(this.ui.camera));
    this.show(camera, settle);
  }

  show(camera, settle = true) {
    this.ui.setCamera(camera, true);
    clearTimeout(this.timer);
    if (settle) this.timer = setTimeout(() => this.settle(), settleMs);
  }

  settle() {
    clearTimeout(this.timer);
    this.ui.setCamera(this.ui.camera, false);
  }

  down(event) {
    this.canvas.focus({preventScroll: true});
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    this.hasMoved = false;
  }

  move(event) {
    const from = this.pointers.get(event.pointerId);
    if (!from) return;
    const width = this.canvas.clientWidth;
    const dx = (event.clientX - from[0]) / width, dy = -(event.clientY - from[1]) / width;
    if (dx === 0 && dy === 0) return;
    this.hasMoved = true;
    const others = [...this.pointers].filter(([id]) => id !== event.pointerId);
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    if (others.length > 0) {
      this.pinch(others[0][1], from, [event.clientX, event.clientY], dx, dy, others.length + 1);
    } else if (event.shiftKey || event.buttons === 4 || event.buttons === 2 || isSky(this.ui.camera)) {
      this.go(pan(this.ui.camera, dx, dy, this.pixels), false);
    } else {
      this.go(orbit(this.ui.camera, dx * turnPerWidth, -dy * turnPerWidth), false);
    }
  }

  /// One of several fingers moves: the move of their middle pans, and the change of their distance
  /// zooms about the middle.
  pinch(other, from, to, dx, dy, fingers) {
    const moved = pan(this.ui.camera, dx / fingers, dy / fingers, this.pixels);
    const distance = (a) => Math.max(Math.hypot(a[0] - other[0], a[1] - other[1]), 1);
    const factor = fingers === 2 ? Math.min(Math.max(distance(from) / distance(to), 0.5), 2) : 1;
    const middle = this.stage.pixelAt((to[0] + other[0]) / 2, (to[1] + other[1]) / 2);
    this.go(zoomAt(moved, factor, middle?.dx ?? 0, middle?.dy ?? 0, this.pixels), false);
  }

  up(event) {
    this.pointers.delete(event.pointerId);
    if (this.pointers.size === 0 && this.hasMoved) this.settle();
  }

  wheel(event) {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 16 : 1;
    const factor = Math.exp(Math.min(Math.max(event.deltaY * lines, -240), 240) * 0.0016);
    const pixel = this.stage.pixelAt(event.clientX, event.clientY);
    this.go(zoomAt(this.ui.camera, factor, pixel?.dx ?? 0, pixel?.dy ?? 0, this.pixels));
  }

  centreOn(event) {
    const pixel = this.stage.pixelAt(event.clientX, event.clientY);
    if (pixel) this.go(centre(this.ui.camera, pixel.dx, pixel.dy, this.pixels));
  }

  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const arrows = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]};
    const arrow = arrows[event.key];
    if (!arrow) return;
    event.preventDefault();
    const [x, y] = arrow, camera = this.ui.camera;
    const pans = event.shiftKey || isSky(camera);
    this.go(pans ? pan(camera, -x * 0.04, -y * 0.04, this.pixels) : orbit(camera, x * 0.07, y * 0.07));
  }

  zoomBy(factor) { this.go(zoom(this.ui.camera, factor)); }
  rollBy(angle) { this.go(roll(this.ui.camera, angle)); }
  /// The view of the file, in which an inclination has the file's meaning.
  goHome() { this.show(this.home()); }

  /// Views of the chosen galaxy.
  faceOn() { return this.look([0, 0, 1], [0, 1, 0]); }
  edgeOn() { return this.look([0, -1, 0], [0, 0, 1]); }
  oblique() { return this.look([0, -1, 0.6], [0, 0, 1]); }

  async look(from, up) {
    if (isSky(this.ui.camera)) return;
    this.doc.fixOrientations(cameraSettings(this.ui.camera));
    await this.doc.queue;
    const pole = poleOf(this.doc.scene, this.doc.chosen);
    this.go(lookFrom(this.ui.camera, alongPole(from, pole), alongPole(up, pole)));
  }

  get canLook() { return isFlat(this.ui.camera); }
}
