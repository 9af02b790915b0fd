// The draft: the galaxy drawn here, from a grid of its light and dust that the server makes once
// for each state of the galaxy. It is shown while the camera moves, where the GPU is fast enough.

import {channelsOf} from './channels.js';
import {unpackSlices} from './framing.js';
import {march} from './draft_shader.js';
import {basis, isFlat, scale, subtract} from './view.js';

const size = 224;           // nodes along each axis in the plane of the disk
const pauseMs = 220;        // without motion, after which a render is asked for
const frameMs = 30;         // of a draft
const stride = 1;           // nodes between two points of a ray
const trials = [48, 192];   // sides of the drafts whose time is measured
const leastSide = 200, mostSide = 1024;
const trueSide = 256;       // of the first render that replaces a draft

/// Whether the processor draws, since there is no GPU.
function isSoftware(gl) {
  const info = gl.getExtension('WEBGL_debug_renderer_info');
  return /swiftshader|llvmpipe|softpipe|software|basic render/i
      .test(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
}

/// Events: `ready` (a draft has come).
export class Draft extends EventTarget {
  constructor({connection, doc, ui, picture, preview, stage}) {
    super();
    Object.assign(this, {connection, doc, ui, picture, preview, stage});
    this.asked = null;     // {id, key} of the draft that is being made
    this.key = null;       // of the present draft
    this.refused = null;   // key of a document without a draft
    this.side = 0;         // longest side that is drawn in time; 0 for none
    this.isShown = false;
    this.isSlow = isSoftware(picture.gl);
    this.taking = Promise.resolve();
    // Slices are unpacked and taken in their order.
    connection.addEventListener('draft', ({detail}) => {
      if (detail.header.id !== this.asked?.id) return;
      this.taking = this.taking.then(() => unpackSlices(detail)).then((slices) => this.take(slices))
          .catch(() => { this.asked = null; });
    });
    connection.addEventListener('message', ({detail}) => this.fail(detail));
    connection.addEventListener('lost', () => { this.asked = null; });
    picture.canvas.addEventListener('restored', () => this.forget());
    preview.addEventListener('asked', () => { this.asked = null; });
    preview.addEventListener('frame', () => this.afterFrame());
    stage.draft = this;
  }

  /// Whether this browser can draw drafts at all.
  get isPossible() {
    const {gl, onGpu} = this.picture;
    return onGpu && !this.isSlow && gl.getParameter(gl.MAX_3D_TEXTURE_SIZE) >= size;
  }

  forget() {
    this.key = this.asked = this.program = this.voxels = this.variants = this.target = null;
    this.isShown = false;
  }

  /// The present state that a draft would show: document and mutes.
  present() {
    return {state: this.doc.state, muted: this.preview.muted(this.doc.model, true)};
  }

  isPresent(key) {
    return key !== null && key.state === this.doc.state &&
        key.muted.join() === this.preview.muted(this.doc.model, true).join();
  }

  /// Asks for the draft when the server has nothing else to do.
  afterFrame() {
    const {width, isPartial} = this.picture.frame.header;
    const isTrue = this.preview.isFinal || (!isPartial && width >= trueSide);
    // A draft of an older state hides what has changed since.
    if (isTrue || !this.isPresent(this.key)) this.isShown = false;
    if (!this.preview.isFinal || !this.isPossible || this.asked || !isFlat(this.ui.camera)) return;
    if (this.isPresent(this.key) || this.isPresent(this.refused)) return;
    const key = this.present();
    const id = this.connection.send('draft', {...this.doc.fields(), muted: key.muted, size});
    if (id !== 0) this.asked = {id, key};
  }

  fail(message) {
    if (message.id !== this.asked?.id) return;
    if (message.op === 'error') this.refused = this.asked.key;
    this.asked = null;
  }

  take({header, halves, variants}) {
    if (header.id !== this.asked?.id) return;
    const gl = this.picture.gl, [nx, ny, nz] = header.axes.map((axis) => axis.nodes);
    gl.activeTexture(gl.TEXTURE2);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
    if (header.slice === 0) this.begin(header);
    const put = (texture, format, values) => {
      gl.bindTexture(gl.TEXTURE_3D, texture);
      gl.texSubImage3D(gl.TEXTURE_3D, 0, 0, 0, header.slice, nx, ny, header.slices, format, gl.HALF_FLOAT, values);
    };
    put(this.voxels, gl.RGBA, halves);
    if (variants) put(this.variants, gl.RG, variants);
    gl.activeTexture(gl.TEXTURE0);
    if (header.slice + header.slices < nz) return;
    this.header = header;
    this.key = this.asked.key;
    this.asked = null;
    if (this.side === 0) this.measure();
    this.dispatchEvent(new Event('ready'));
  }

  begin(header) {
    const gl = this.picture.gl;
    this.key = null;
    this.isShown = false;
    this.program ??= this.picture.program(march);
    this.target ??= this.picture.nearest(gl.TEXTURE_2D);
    for (const texture of [this.voxels, this.variants]) if (texture) gl.deleteTexture(texture);
    const nodes = header.axes.map((axis) => axis.nodes);
    this.voxels = this.grid(gl.RGBA16F, nodes);
    this.variants = this.grid(gl.RG16F, header.variants ? nodes : [1, 1, 1]);
  }

  grid(format, nodes) {
    const gl = this.picture.gl, texture = this.picture.nearest(gl.TEXTURE_3D);
    for (const key of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_3D, key, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_3D, gl.TEXTURE_WRAP_R, gl.CLAMP_TO_EDGE);
    gl.texStorage3D(gl.TEXTURE_3D, 1, format, ...nodes);
    return texture;
  }

  /// Finds the side whose drafts take `frameMs`. Where the GPU is slow there is none.
  measure() {
    const gl = this.picture.gl, pixel = new Float32Array(4);
    for (const side of trials) {
      const begin = performance.now();
      this.march(this.ui.camera, side, side);
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.picture.target);
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.FLOAT, pixel);
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
      const milliseconds = Math.max(performance.now() - begin, 0.1);
      this.side = Math.min(Math.round(side * Math.sqrt(frameMs / milliseconds)), mostSide);
      if (milliseconds > 3 * frameMs) break;
    }
    this.isSlow = this.side < leastSide;
  }

  /// Shows the draft of the present camera, unless there is none. It asks for a render in a pause.
  show() {
    const {doc, preview, ui} = this;
    if (this.isSlow || !doc.model || preview.isPaused || !this.isPresent(this.key) || !isFlat(ui.camera)) return false;
    if (ui.look.psf > 0 || ui.look.noise > 0 || !ui.tone) return false;
    if (preview.asked.size > 0) preview.cancel();
    this.isShown = true;
    clearTimeout(this.pause);
    this.pause = setTimeout(() => preview.ask(false), pauseMs);
    this.stage.draw();
    return true;
  }

  draw(tone, look) {
    const {room} = this.picture, part = Math.min(this.side / Math.max(...room), 1);
    const sides = room.map((side) => Math.max(Math.round(side * part), 1));
    this.march(this.ui.camera, ...sides);
    this.picture.paint([this.target], sides, tone, look);
  }

  /// Draws the channels of a view into the target.
  march(camera, width, height) {
    const {picture, header} = this, {gl} = picture, {program, places} = this.program;
    gl.useProgram(program);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.target);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, width, height, 0, gl.RGBA, gl.FLOAT, null);
    gl.bindTexture(gl.TEXTURE_2D, null);
    gl.activeTexture(gl.TEXTURE2);
    gl.bindTexture(gl.TEXTURE_3D, this.voxels);
    gl.activeTexture(gl.TEXTURE3);
    gl.bindTexture(gl.TEXTURE_3D, this.variants);
    gl.uniform1i(places.voxels, 2);
    gl.uniform1i(places.variants, 3);
    gl.uniform1i(places.has_variants, header.variants ? 1 : 0);
    const all = (key) => header.axes.map((axis) => axis[key]);
    gl.uniform3fv(places.nodes, all('nodes'));
    gl.uniform3fv(places.core, all('core'));
    gl.uniform3fv(places.share, all('share'));
    gl.uniformMatrix3fv(places.to_ball, false, header.to_ball);
    const axes = basis(camera), isPerspective = camera.projection === 'perspective';
    const half = isPerspective ? Math.tan(camera.fov * Math.PI / 360) : camera.width / 2;
    gl.uniform1i(places.perspective, isPerspective ? 1 : 0);
    gl.uniform3fv(places.eye, subtract(camera.position, header.centre));
    gl.uniform3fv(places.right, scale(axes.right, half));
    gl.uniform3fv(places.up, scale(axes.up, half * height / width));
    gl.uniform3fv(places.back, axes.back);
    gl.uniform1f(places.side, 2 / width);
    gl.uniformMatrix3fv(places.light, false, this.channelMatrix());
    gl.uniform3fv(places.extinction, [0, 1, 2].map((p) => (header.planes[p]?.extinction ?? 0) * header.depth / header.radius));
    gl.uniform1f(places.stride, stride);
    gl.bindFramebuffer(gl.FRAMEBUFFER, picture.target);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.target, 0);
    gl.viewport(0, 0, width, height);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.activeTexture(gl.TEXTURE0);
  }

  /// The matrix, by columns, from the numbers of a voxel to the brightness of the channels.
  channelMatrix() {
    const {planes, radius} = this.header, {weights} = channelsOf(this.header, this.ui.channels);
    return [0, 1, 2].flatMap((p) => weights.map((channel) => (channel[p] ?? 0) * (planes[p]?.light ?? 0) / radius));
  }

  /// The channels of a draft, four numbers each, row 0 at the bottom.
  channels(camera, width, height) {
    this.march(camera, width, height);
    return this.picture.pixelsOf(this.target, width, height);
  }
}
