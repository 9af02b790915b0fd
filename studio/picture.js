// The picture: float planes in a WebGL2 canvas. Planes are summed to three channels with a weight
// for each plane and channel, then stretched. No change of weights or stretch needs the server. The
// canvas has the pixels of a final picture, also while coarse ones are drawn. The browser scales them
// to their place in the page.

import {automaticTone, steepnessOf, withContrast} from './stretch.js';
import * as shaders from './shaders.js';
import {planeGroups} from './plane_groups.js';
import {kernelLength} from './seeing.js';
import {sizeTo} from './dom.js';

// A texel holds four planes. A shader adds at most this many texels for a pixel.
const planesPerTexel = 4, mostTexels = 48;
// Largest number of pixels of the canvas, relative to those of the screen that show it.
const mostPixels = 2;

/// The four planes of a texel for `count` pixels, with 0 for numbers that are not finite. `values`
/// has plane after plane.
export function packTexels(values, count, texel) {
  const packed = new Float32Array(planesPerTexel * count);
  const end = Math.min(planesPerTexel * (texel + 1), values.length / count);
  for (let plane = planesPerTexel * texel; plane < end; ++plane) {
    const from = values.subarray(plane * count, (plane + 1) * count);
    for (let i = 0, to = plane % planesPerTexel; i < count; ++i, to += planesPerTexel) {
      packed[to] = Number.isFinite(from[i]) ? from[i] : 0;
    }
  }
  return packed;
}

export class Picture {
  /// Throws Error where the browser has no WebGL2.
  constructor(canvas) {
    this.canvas = canvas;
    this.frame = null;
    this.room = null;  // screen pixels that show the canvas; null: the frame's pixels
    canvas.addEventListener('webglcontextlost', (event) => event.preventDefault());
    canvas.addEventListener('webglcontextrestored', () => {
      this.begin();
      if (this.frame) this.setFrame(this.frame, this.isCoarse);
      canvas.dispatchEvent(new Event('restored'));
    });
    this.begin();
  }

  begin() {
    const gl = this.canvas.getContext('webgl2', {alpha: false, antialias: false});
    if (!gl) throw new Error('This browser has no WebGL2, which draws the picture.');
    this.gl = gl;
    this.onGpu = gl.getExtension('EXT_color_buffer_float') !== null;
    this.programs = new Map();  // by text
    this.seeing = this.onGpu ? this.program(shaders.seeing.replace('KERNEL_LENGTH', kernelLength)) : null;
    const corners = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, corners);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 3, -1, -1, 3]), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 0, 0);
    this.planes = gl.createTexture();
    this.channels = this.nearest(gl.TEXTURE_2D);
    this.others = [0, 1].map(() => this.nearest(gl.TEXTURE_2D));  // blurred channels, or sums of groups
    this.target = gl.createFramebuffer();
  }

  program(fragment) {
    const gl = this.gl, program = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, shaders.square], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.bindAttribLocation(program, 0, 'corner');
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    const places = {};
    const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS);
    for (let i = 0; i < count; ++i) {
      const {name} = gl.getActiveUniform(program, i);
      places[name] = gl.getUniformLocation(program, name);
    }
    return {program, places};
  }

  /// The program of a text, which is made once.
  programOf(fragment) {
    if (!this.programs.has(fragment)) this.programs.set(fragment, this.program(fragment));
    return this.programs.get(fragment);
  }

  nearest(kind) {
    const gl = this.gl, texture = gl.createTexture();
    gl.bindTexture(kind, texture);
    for (const key of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(kind, key, gl.NEAREST);
    for (const key of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(kind, key, gl.CLAMP_TO_EDGE);
    return texture;
  }

  /// Takes the planes of a frame (framing.js). A coarse frame keeps the canvas of a finer one.
  setFrame(frame, isCoarse = false) {
    const gl = this.gl, {width, height, planes} = frame.header;
    this.frame = frame;
    this.isCoarse = isCoarse;
    this.texels = Math.ceil(planes.length / planesPerTexel);
    this.sumsOnGpu = this.onGpu && this.texels <= mostTexels;
    this.forget();
    if (!this.onGpu) return;
    for (const texture of [this.channels, ...this.others]) {
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, width, height, 0, gl.RGBA, gl.FLOAT, null);
    }
    gl.deleteTexture(this.planes);
    if (!this.sumsOnGpu) return;
    this.planes = this.nearest(gl.TEXTURE_2D_ARRAY);
    gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, gl.RGBA32F, width, height, this.texels);
    this.putRows(0, height, frame.values);
  }

  /// Takes rows of the frame that have changed, as a strip (strips.js) brings them.
  setRows({header: {row, rows}, values}) {
    this.forget();
    if (this.sumsOnGpu) this.putRows(row, rows, values);
  }

  /// Forgets all sums of the planes.
  forget() {
    this.isSummed = false;
    this.read = null;
    this.base = null;    // the weights of the first sum
    this.summed = null;  // the groups of planes whose sums `others` holds, as text
    this.wanted = null;  // the groups that were wanted last
  }

  putRows(row, rows, values) {
    const gl = this.gl, {width} = this.frame.header;
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.planes);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
    for (let texel = 0; texel < this.texels; ++texel) {
      gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, row, texel, width, rows, 1, gl.RGBA, gl.FLOAT,
                       packTexels(values, width * rows, texel));
    }
  }

  /// Takes the weights [red, green, blue] of each plane.
  setWeights(weights) {
    const key = weights.flat().join();
    if (key === this.key && this.isSummed) return;
    this.key = key;
    this.weightList = weights;
    this.isSummed = false;
    this.read = null;
  }

  sumUp() {
    if (this.isSummed) return;
    const gl = this.gl, {width, height} = this.frame.header;
    this.isSummed = true;
    if (!this.sumsOnGpu) {
      this.read = this.sumHere();
      gl.bindTexture(gl.TEXTURE_2D, this.channels);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, width, height, 0, gl.RGBA, gl.FLOAT, this.read);
      return;
    }
    this.base ??= this.weightList;
    this.sumInto(this.channels, this.weightList);
  }

  /// Adds the planes with weights into a texture.
  sumInto(texture, weightList) {
    const gl = this.gl, {width, height} = this.frame.header;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    const {program, places} = this.programOf(shaders.sum(this.texels));
    gl.useProgram(program);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.planes);
    gl.uniform1i(places.planes, 0);
    const weights = new Float32Array(3 * planesPerTexel * this.texels);
    weights.set(weightList.flat());
    gl.uniformMatrix4x3fv(places['weights[0]'], false, weights);
    gl.viewport(0, 0, width, height);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  /// The factors of the sums of two groups of planes (plane_groups.js) that together make the
  /// channels. Null where all planes must be added anew.
  factorsOfGroups() {
    if (this.isSummed || !this.base) return null;
    const found = planeGroups(this.base, this.weightList);
    if (!found) {
      this.base = this.summed = null;
      return null;
    }
    const key = found.groups.join();
    if (key !== this.summed) {
      // Two sums pay only if these groups come again.
      const comesAgain = key === this.wanted;
      this.wanted = key;
      if (!comesAgain) return null;
      this.summed = key;
      this.others.forEach((texture, group) => this.sumInto(
          texture, this.base.map((weight, plane) => found.groups[plane] === group ? weight : [0, 0, 0])));
    }
    return found.factors;
  }

  /// The channels with PSF and noise (seeingOf() in seeing.js), as a texture.
  seen(seeing) {
    if (!seeing || !this.onGpu) return this.channels;
    const gl = this.gl, {width, height} = this.frame.header, {program, places} = this.seeing;
    this.summed = null;
    gl.useProgram(program);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.viewport(0, 0, width, height);
    gl.activeTexture(gl.TEXTURE0);
    gl.uniform1i(places.channels, 0);
    gl.uniform1fv(places['kernel[0]'], seeing.kernel);
    gl.uniform1i(places.reach, seeing.kernel.length - 1);
    [[1, 0], [0, 1]].forEach((way, i) => {
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.others[i], 0);
      gl.bindTexture(gl.TEXTURE_2D, i === 0 ? this.channels : this.others[0]);
      gl.uniform2iv(places.way, way);
      gl.uniform1f(places.noise, i === 0 ? 0 : seeing.noise);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    });
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return this.others[1];
  }

  /// The sums by the processor, for browsers that cannot draw into floats and for too many planes.
  sumHere() {
    const {width, height} = this.frame.header;
    const sums = new Float32Array(4 * width * height);
    this.weightList.forEach((weight, i) => {
      const plane = this.frame.plane(i);
      for (let at = 0; at < plane.length; ++at) {
        if (!Number.isFinite(plane[at])) continue;
        for (let c = 0; c < 3; ++c) sums[4 * at + c] += weight[c] * plane[at];
      }
    });
    return sums;
  }

  /// The three channels of every pixel, four numbers each, row 0 at the bottom.
  sums() {
    this.sumUp();
    this.read ??= this.pixelsOf(this.channels);
    return this.read;
  }

  pixelsOf(texture, width = this.frame.header.width, height = this.frame.header.height) {
    const gl = this.gl;
    const pixels = new Float32Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, pixels);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return pixels;
  }

  /// The tone that the program would choose for these channels.
  /// `factors` are those of channelFactors().
  tone(isGrey, factors) {
    const sums = this.sums();
    if (this.toned?.sums !== sums || this.toned.isGrey !== isGrey) {
      this.toned = {sums, isGrey, tone: this.toneOf(sums, isGrey, factors)};
    }
    return this.toned.tone;
  }

  toneOf(sums, isGrey, factors) {
    const count = sums.length / 4;
    const channels = [];
    for (let c = 0; c < (isGrey ? 1 : 3); ++c) {
      const channel = new Float64Array(count);
      for (let i = 0; i < count; ++i) channel[i] = sums[4 * i + c];
      channels.push(channel);
    }
    return automaticTone(channels, this.frame.header.width, factors);
  }

  /// Draws with a tone and a look (stretch.js) for a room of pixels, with PSF and noise or without.
  draw(tone, look, seeing = null, room = this.room) {
    if (!this.frame || this.gl.isContextLost()) return;
    const {width, height} = this.frame.header;
    const factors = seeing ? null : this.factorsOfGroups();
    if (factors) return this.paint(this.others, [width, height], tone, look, room, factors, this.isCoarse);
    this.sumUp();
    this.paint([this.seen(seeing)], [width, height], tone, look, room, null, this.isCoarse);
  }

  /// Draws the channels of textures of a size, each times its factor. Where the room has far fewer
  /// pixels, so has the canvas, and the light is interpolated.
  paint(textures, size, tone, look, room = this.room, factors = null, isCoarse = false) {
    const {canvas} = this;
    const isLarge = room !== null && size[0] * size[1] > mostPixels * room[0] * room[1];
    const isKept = !isLarge && room !== null && isCoarse && this.fits(size);
    const drawn = isLarge ? room : isKept ? [canvas.width, canvas.height] : size;
    sizeTo(canvas, ...drawn);
    canvas.style.imageRendering = look.pixels ? 'pixelated' : 'auto';
    this.stretch(textures, factors, drawn, tone, look, (isLarge || isKept) && !look.pixels);
  }

  /// Whether the canvas shows a picture of this aspect with at least as many pixels. A coarse
  /// picture is then drawn without a change of the canvas, which takes longer than many pixels.
  fits([width, height]) {
    const {canvas} = this;
    return canvas.width >= width && Math.abs(canvas.width * height - canvas.height * width) <= Math.max(canvas.width, canvas.height);
  }

  /// Makes colours of the channels of one texture, or of two textures with factors, in `size`
  /// pixels.
  stretch(textures, factors, size, tone, look, isSmoothed) {
    const gl = this.gl, {mode, gamma, saturation} = look;
    const {slope, white, hasShoulder} = withContrast(look, Math.max(look.white - look.black, 0));
    const {program, places} = this.programOf(shaders.stretch(
        {mode, smoothed: isSmoothed, shoulder: hasShoulder, gamma: gamma !== 1, saturation: saturation !== 1, groups: factors !== null}));
    gl.useProgram(program);
    textures.forEach((texture, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
    });
    gl.uniform1i(places.channels, 0);
    if (factors) {
      gl.uniform1i(places.others, 1);
      gl.uniform2fv(places.factors, factors);
    }
    gl.activeTexture(gl.TEXTURE0);
    gl.uniform3fv(places.black, tone.black);
    gl.uniform3fv(places.factor, tone.factor);
    gl.uniform1f(places.slope, slope);
    gl.uniform1f(places.white, white);
    gl.uniform1f(places.steepness, steepnessOf(mode, slope * white));
    gl.uniform1f(places.handle, look.black);
    gl.uniform1f(places.gain, 2 ** look.exposure);
    gl.uniform1f(places.gamma, gamma);
    gl.uniform1f(places.saturation, saturation);
    gl.viewport(0, 0, ...size);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /// The bytes that were drawn in this task, RGBA from the bottom.
  shown() {
    const gl = this.gl, {width, height} = this.canvas;
    const bytes = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    return bytes;
  }
}
