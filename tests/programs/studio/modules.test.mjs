// Unit tests of the page's modules that need no browser: `node --test`.

import assert from 'node:assert/strict';
import {test} from 'node:test';
import {deflateSync} from 'node:zlib';

import {animationProblem, animationSettings, cameraAt, smoothPath} from '../../../studio/animation.js';
import {channelsOf, planeWeights} from '../../../studio/channels.js';
import {excludedBy} from '../../../studio/document.js';
import {parseFrame, unpackSlices} from '../../../studio/framing.js';
import {History} from '../../../studio/history.js';
import {uselessness} from '../../../studio/key_use.js';
import {shareEdits, shareFactors, sharing, valueEdits} from '../../../studio/light.js';
import {packTexels} from '../../../studio/picture.js';
import {planeGroups} from '../../../studio/plane_groups.js';
import {gaussianKernel, seeingOf} from '../../../studio/seeing.js';
import {columnsOf, hasInclination, poleOf, rowAfterDelete, rowsOf, valueOf, visibleRows} from '../../../studio/scene_rows.js';
import {positionOf, sliderScale, text, valueAt} from '../../../studio/scale.js';
import {automaticTone, channelFactors, channelWeights, colour, level, lightOf, plainLook, selected} from '../../../studio/stretch.js';
import {completed, empty, enlarged, isEnd, putStrip} from '../../../studio/strips.js';
import * as view from '../../../studio/view.js';
import {skyOf} from '../../../studio/wcs.js';

function near(actual, expected, tolerance, message) {
  assert.ok(Math.abs(actual - expected) <= tolerance, `${message ?? ''} ${actual}, expected ${expected}`);
}

function nearAll(actual, expected, tolerance) {
  assert.equal(actual.length, expected.length);
  actual.forEach((value, i) => near(value, expected[i], tolerance, `[${i}]`));
}

// --- messages

function frameOf(header, values, padding = 0) {
  const head = new TextEncoder().encode(JSON.stringify(header));
  const length = Math.ceil(head.length / 4) * 4;
  const bytes = new Uint8Array(4 + length + 4 * values.length + padding).fill(0x20, 4, 4 + length);
  bytes.set(head, 4);
  new DataView(bytes.buffer).setUint32(0, length, true);
  bytes.set(new Uint8Array(new Float32Array(values).buffer), 4 + length);
  return bytes.buffer;
}

test('a frame has its planes', () => {
  const header = {id: 3, width: 2, height: 1, planes: [{label: 'a'}, {label: 'b'}]};
  const frame = parseFrame(frameOf(header, [1, 2, 3, 4.5]));
  assert.deepEqual(frame.header, header);
  assert.deepEqual([...frame.plane(0)], [1, 2]);
  assert.deepEqual([...frame.plane(1)], [3, 4.5]);
});

test('wrong frames are refused', () => {
  const header = {width: 2, height: 1, planes: [{}]};
  const good = frameOf(header, [1, 2]);
  assert.throws(() => parseFrame(new ArrayBuffer(2)), RangeError);
  assert.throws(() => parseFrame(good.slice(0, good.byteLength - 4)), RangeError);
  assert.throws(() => parseFrame(frameOf(header, [1, 2], 4)), RangeError);
  const long = good.slice(0);
  new DataView(long).setUint32(0, 1 << 30, true);
  assert.throws(() => parseFrame(long), RangeError);
});

test('slices of a draft are unpacked', async () => {
  const header = {axes: [{nodes: 2}, {nodes: 1}, {nodes: 4}], slice: 1, slices: 2, variants: true, planes: []};
  const packedOf = (codes, head = header) => {
    const bytes = deflateSync(Buffer.from([...codes.map((code) => code >> 8), ...codes.map((code) => code & 255)]));
    const empty = frameOf(head, []), whole = new Uint8Array(empty.byteLength + bytes.length);
    whole.set(new Uint8Array(empty));
    whole.set(bytes, empty.byteLength);
    return parseFrame(whole.buffer);
  };
  // The first plane has the codes 100, 101 and 99, 100. The second plane has 5 more, then 4 less;
  // and so on.
  const first = [200, 2, 198, 2], second = [10, 0, 7, 0], third = [0, 0, 0, 0], dust = [600, 1, 0, 0];
  const others = [4, 0, 0, 0, 3, 0, 0, 0];
  const {halves, variants} = await unpackSlices(packedOf([...first, ...second, ...third, ...dust, ...others]));
  const of = (list, step, number) => [0, 1, 2, 3].map((i) => list[step * i + number] / 16);
  assert.deepEqual(of(halves, 4, 0), [100, 101, 99, 100]);
  assert.deepEqual(of(halves, 4, 1), [105, 106, 95, 96]);
  assert.deepEqual(of(halves, 4, 2), [100, 101, 99, 100]);
  assert.deepEqual(of(halves, 4, 3), [300, 299, 0, 0]);
  assert.deepEqual(of(variants, 2, 0), [302, 301, 0, 0]);
  assert.deepEqual(of(variants, 2, 1), [298, 297, 0, 0]);
  const short = packedOf([...first, ...second, ...third, ...dust], {...header, variants: false});
  assert.equal((await unpackSlices(short)).variants, null);
  await assert.rejects(unpackSlices({...short, header}), RangeError);
});

test('strips replace rows of an enlarged frame', () => {
  const planes = [{label: 'a', component: 0}, {label: 'a', component: 1}];
  const coarse = parseFrame(frameOf({width: 2, height: 2, planes}, [1, 2, 3, 4, 5, 6, 7, 8]));
  const strip = parseFrame(frameOf({width: 4, height: 4, row: 2, rows: 1, planes: [planes[1], planes[0]]},
                                   [10, 11, 12, 13, 20, 21, 22, 23]));
  const frame = enlarged(strip.header, coarse);
  putStrip(frame, strip);
  assert.deepEqual([...frame.plane(0)], [5, 5, 6, 6, 5, 5, 6, 6, 10, 11, 12, 13, 7, 7, 8, 8]);
  assert.deepEqual([...frame.plane(1)], [1, 1, 2, 2, 1, 1, 2, 2, 20, 21, 22, 23, 3, 3, 4, 4]);
  const other = {...strip.header, planes: [{label: 'b', component: 0}]};
  assert.equal(enlarged(other, coarse), null);
});

test('strips fill a frame of their own, which the last message ends', () => {
  const planes = [{label: 'a', component: null}], size = {width: 2, height: 2, planes};
  const strips = [[1, [3, 4]], [0, [1, 2]]].map(([row, values]) => parseFrame(frameOf({...size, row, rows: 1}, values)));
  const frame = empty(strips[0].header);
  for (const strip of strips) putStrip(frame, strip);
  assert.ok(frame.header.isPartial);
  const end = parseFrame(frameOf({...size, row: 2, rows: 0, milliseconds: 5}, []));
  assert.deepEqual([...strips, end].map((one) => isEnd(one.header)), [false, false, true]);
  const whole = completed(frame, end.header);
  assert.deepEqual([...whole.plane(0)], [1, 2, 3, 4]);
  assert.deepEqual([whole.header.row, whole.header.rows, whole.header.isPartial, whole.header.milliseconds], [0, 2, false, 5]);
});

// --- undo

const stateOf = (text, settings = {}) => ({galaxies: {a: text}, settings, scene: 'galaxy x'});

test('undo and redo walk through all states', () => {
  const history = new History(stateOf('0'));
  for (let i = 1; i <= 1000; ++i) history.commit(stateOf(String(i)), `step ${i}`);
  for (let i = 999; i >= 0; --i) {
    assert.ok(history.undo());
    assert.equal(history.state.galaxies.a, String(i));
  }
  assert.equal(history.undo(), false);
  assert.equal(history.redoLabel, 'step 1');
  assert.ok(history.redo());
  history.commit(stateOf('other'), 'other');
  assert.equal(history.canRedo, false);
  assert.equal(history.states.length, 3);
});

test('states with one key are one step until undo', () => {
  const history = new History(stateOf('0'));
  history.commit(stateOf('1'), 'x', 'x');
  history.commit(stateOf('2'), 'x', 'x');
  assert.equal(history.states.length, 2);
  history.undo();
  assert.equal(history.state.galaxies.a, '0');
  history.redo();
  history.commit(stateOf('3'), 'x', 'x');
  assert.equal(history.states.length, 3);
});

test('a packed history is the same, with each text once', () => {
  const history = new History(stateOf('0'));
  history.commit(stateOf('1', {'image.size': [8, 8]}), 'one');
  history.commit(stateOf('0'), 'two');
  history.undo();
  const packed = JSON.parse(JSON.stringify(history.pack()));
  assert.equal(packed.texts.filter((text) => text === '0').length, 1);
  const again = History.unpack(packed);
  assert.deepEqual(again.states, history.states);
  assert.equal(again.at, 1);
  assert.deepEqual(History.unpack(history.pack(1)).state, history.state);
});

test('rows of a scene', () => {
  const {columns, rows} = rowsOf('# a\ngalaxy x\tsed # b\r\n\nm51  1.5 -\n  # c\nlmc 2 E');
  assert.deepEqual(columns, ['galaxy', 'x', 'sed']);
  assert.deepEqual(rows, [['m51', '1.5', '-'], ['lmc', '2', 'E']]);
  assert.equal(valueOf('1.5', 'number'), 1.5);
  assert.equal(valueOf('10:30:00', 'number'), '10:30:00');
  assert.equal(valueOf('-', 'number'), null);
  assert.equal(valueOf('12', 'text'), '12');
  const {own, others} = columnsOf(['x', 'arms.count'], [{name: 'x', type: 'number'}, {name: 'y'}]);
  assert.deepEqual(own.map(({name, type}) => [name, type]), [['x', 'number'], ['arms.count', 'text']]);
  assert.deepEqual(others, [{name: 'y'}]);
  assert.deepEqual(visibleRows(0, 168, 24, 3), [0, 3]);
  assert.deepEqual(visibleRows(24000, 168, 24, 2000), [998, 1009]);
  assert.equal(rowAfterDelete(4, 5), 3);
});

test('keys that a choice excludes are taken out', () => {
  const model = {set: [null, 'arms.model', 'logarithmic']};
  const message = "galaxy:7:13: 'winding_b' needs model = \"ringermacher-mead\"";
  assert.deepEqual(excludedBy(message, [model]), {reset: [null, 'arms.winding_b']});
  assert.equal(excludedBy(message, [{reset: [null, 'arms.winding_b']}, model]), null);
  assert.equal(excludedBy(message, [{set: [null, 'arms.winding_b', 2]}]), null);
  assert.deepEqual(excludedBy("galaxy:4:3: component 'd': noise: amplitude belongs to combination = \"multiplicative\", not \"ridged\"",
                              [{set: [2, 'noise.combination', 'ridged']}]), {reset: [2, 'noise.amplitude']});
  assert.equal(excludedBy("'model' needs more", [model]), null);
  assert.equal(excludedBy('other', [model]), null);
  assert.deepEqual(excludedBy("galaxy:4:3: component 'd': 'outer_rh' belongs to a break; give 'break_radius'",
                              [{set: [1, 'break_radius', 0]}]), {reset: [1, 'outer_rh']});
});

test('a parameter says why it does not matter', () => {
  const declared = {needs: [{key: 'noise', values: ['true'], excluded: false},
                            {key: 'noise.warp', values: ['0'], excluded: true}]};
  const of = (values) => uselessness(declared, (key) => values[key]);
  assert.equal(of({noise: true, 'noise.warp': 0.1}), null);
  assert.equal(of({noise: true, 'noise.warp': 0}), 'Has no effect while warp is 0.');
  assert.equal(of({noise: false, 'noise.warp': 0.1}), 'Needs noise, which is off.');
  const needs = [{key: 'arms.model', values: ['a', 'b'], excluded: false}];
  assert.equal(uselessness({needs}, () => 'c'), 'Belongs to model a or b.');
  assert.equal(uselessness({needs}, () => 'b'), null);
  const stars = [{key: 'sed', values: [''], excluded: false}];
  assert.equal(uselessness({needs: stars}, () => null), null);
  assert.equal(uselessness({needs: stars}, () => 'E'), 'Has no effect while sed is given.');
  assert.equal(uselessness({}, () => null), null);
});

// --- shares of light

const component = (fraction, given = ['fraction']) => ({values: {fraction}, given});

test('shares keep their sum of 1 and their ratios', () => {
  const components = [component(0.2), {values: {}, given: []}, component(0.5), component(0.3)];
  const edits = shareEdits(components, 0, 0.6);
  const shares = new Map(edits.map(({set: [i, , value]}) => [i, value]));
  assert.deepEqual([...shares.keys()], [0, 2, 3]);
  near([...shares.values()].reduce((a, b) => a + b), 1, 1e-9);
  near(shares.get(2) / shares.get(3), 5 / 3, 1e-5);
  assert.equal(shares.get(0), 0.6);
  assert.deepEqual(sharing(components), [0, 2, 3]);
  const after = components.map((one, i) => component(shares.get(i) ?? null));
  nearAll(shareFactors(components, after), [3, 1, 0.5, 0.5], 1e-5);
});

test('a component of light alone has all of it', () => {
  assert.deepEqual(shareEdits([component(1)], 0, 0.3), [{set: [0, 'fraction', 1]}]);
  assert.deepEqual(shareEdits([component(0.25)], null), [{set: [0, 'fraction', 1]}]);
});

test('beside intensities shares are free', () => {
  const components = [component(0.2), component(null, ['intensity']), component(0.5)];
  assert.deepEqual(shareEdits(components, 0, 0.3), [{set: [0, 'fraction', 0.3]}]);
  // A share is limited so that the other components keep light.
  assert.deepEqual(shareEdits(components, 0, 0.9), [{set: [0, 'fraction', 0.495]}]);
  assert.deepEqual(shareEdits(components, null), []);
  const full = shareEdits([...components, component(0.5)], null).map(({set}) => set[2]);
  near(full.reduce((a, b) => a + b), 0.95, 1e-5);
});

test('a component has a share or an intensity, and its activity changes the other shares', () => {
  const components = [component(0.25), component(0.75)];
  assert.deepEqual(valueEdits(components, 0, 'intensity', 2), [{reset: [0, 'fraction']}, {set: [0, 'intensity', 2]}]);
  assert.deepEqual(valueEdits(components, 0, 'active', false), [{set: [0, 'active', false]}, {set: [1, 'fraction', 1]}]);
  const bright = [component(null, ['intensity']), component(0.5)];
  assert.deepEqual(valueEdits(bright, 0, 'fraction', 0.2),
                   [{reset: [0, 'intensity']}, {set: [0, 'fraction', 0.2]}, {set: [1, 'fraction', 0.8]}]);
  assert.deepEqual(valueEdits(components, 1, 'rh', 0.1), [{set: [1, 'rh', 0.1]}]);
});

// --- sliders

test('positions and values are inverse', () => {
  for (const declared of [{min: 0, max: 1, type: 'number'}, {min: 1e-5, max: 1, scale: 'log', type: 'number'},
                          {min: 1, max: 32, default: 7, type: 'integer'}, {min: null, max: null, default: 0, type: 'number'}]) {
    const scale = sliderScale(declared, declared.default ?? 0.5);
    for (const position of [0, 0.1, 0.5, 0.9, 1]) {
      const value = valueAt(scale, position);
      assert.ok(value >= scale.low && value <= scale.high);
      near(positionOf(scale, value), position, declared.type === 'integer' ? 0.02 : 2e-3);
    }
  }
});

test('a slider reaches values beyond its soft bounds', () => {
  const scale = sliderScale({min: 0, max: 100, soft_min: 0, soft_max: 3, type: 'number'}, 50);
  assert.equal(scale.high, 50);
});

test('numbers are short texts', () => {
  assert.deepEqual([0.1 + 0.2, 12, 1e-7, 123456789.5].map(text), ['0.3', '12', '1e-7', '1.235e+8']);
});

// --- stretch

test('planes become channels as in the program', () => {
  assert.deepEqual(channelWeights([5500]), [[1], [1], [1]]);
  assert.deepEqual(channelWeights([4000, 8000]), [[0, 1], [0.5, 0.5], [1, 0]]);
  assert.deepEqual(channelWeights([1, 2, 3, 4, 5]),
                   [[0, 0, 0, 0, 1], [0, 0, 0.5, 0.5, 0], [0.5, 0.5, 0, 0, 0]]
                       .map((weights) => weights));
  assert.deepEqual(channelWeights([null, null, null]), [[1, 0, 0], [0, 1, 0], [0, 0, 1]]);
});

test('light of components is weighted by its share', () => {
  const header = {planes: [{label: 'b', wavelength: 4400, component: 0}, {label: 'r', wavelength: 6500, component: 0},
                           {label: 'b', wavelength: 4400, component: 2}, {label: 'r', wavelength: 6500, component: 2}]};
  const weights = planeWeights(header, null, (i) => i === 2 ? 3 : 0);
  assert.deepEqual(weights, [[0, 0, 0], [0, 0, 0], [0, 1.5, 3], [3, 1.5, 0]]);
  assert.ok(channelsOf(header, ['b', 'b', 'b']).isGrey);
  assert.deepEqual(channelsOf(header, ['b', 'r', 'b']).weights, [[1, 0], [0, 1], [1, 0]]);
});

test('levels have their inverse and their ends', () => {
  for (const mode of ['linear', 'log', 'asinh']) {
    near(level(mode, 0, 40, 3), 0, 0);
    near(level(mode, 3, 40, 3), 1, 1e-15);
    near(lightOf(mode, level(mode, 0.7, 40, 3), 40, 3), 0.7, 1e-14);
  }
  near(level('log', 1, 10, 2), Math.log(11) / Math.log(21), 1e-15);
});

test('the stretch of Lupton et al. keeps ratios and fits the largest channel', () => {
  const tone = {black: [0, 0, 0], factor: [1, 1, 1], slope: 5, white: 2};
  const look = plainLook(tone);
  const faint = colour(tone, look, [0.3, 0.2, 0.1]);
  near(faint[0] / faint[1], 1.5, 1e-14);
  near(faint[0], 0.3 * Math.asinh(1) / 0.2 / Math.asinh(10), 1e-15);
  const bright = colour(tone, look, [30, 20, 10]);
  nearAll(bright, [1, 2 / 3, 1 / 3], 1e-15);
  assert.deepEqual(colour(tone, look, [0, 0, 0]), [0, 0, 0]);
});

test('contrast keeps the level 0.28 and ends in white', () => {
  const tone = {black: [0, 0, 0], factor: [1, 1, 1], slope: 5, white: 2};
  const plain = plainLook(tone), fixed = lightOf('asinh', 0.28, 5, 2);
  for (const contrast of [0.5, 3]) {
    const look = {...plain, contrast}, scale = 0.28 / Math.asinh(5 / contrast * fixed);
    for (const value of [0.1 * fixed, fixed, 2, 50]) {
      const shown = scale * Math.asinh(5 / contrast * value);
      const expected = contrast < 1 ? Math.min(shown, 1) : shown < 0.7 ? shown : 1 - 0.3 * Math.exp((0.7 - shown) / 0.3);
      nearAll(colour(tone, look, [value, value, value]), [expected, expected, expected], 1e-13);
    }
  }
  const star = colour(tone, {...plain, contrast: 3}, [3000, 1500, 500]);
  assert.ok(star[0] > 0.99 && star[1] > 0.99 && star[2] > colour(tone, plain, [3000, 1500, 500])[2]);
});

test('exposure, black, saturation and gamma', () => {
  const tone = {black: [1, 1, 1], factor: [2, 2, 2], slope: 1, white: 10};
  const look = {...plainLook(tone), mode: 'linear', exposure: 1, black: 2};
  nearAll(colour(tone, look, [2.5, 2.5, 2.5]), [0.5, 0.5, 0.5], 1e-15);
  nearAll(colour(tone, {...look, gamma: 2}, [2.5, 2.5, 2.5]), [0.5, 0.5, 0.5].map(Math.sqrt), 1e-15);
  const grey = colour(tone, {...look, saturation: 0}, [2, 2.5, 3]);
  nearAll(grey, [0.5, 0.5, 0.5], 1e-15);
});

test('the number at a place is that of sorted numbers', () => {
  for (const size of [1, 2, 7, 1000]) {
    for (const count of [1, 3, size]) {
      const numbers = Float64Array.from({length: size}, (_, i) => (i * 7919 + 13) % 1009 % count);
      const sorted = numbers.slice().sort();
      for (const place of new Set([0, size >> 1, size - 1, Math.trunc(0.95 * size)])) {
        assert.equal(selected(numbers.slice(), place), sorted[place]);
      }
    }
  }
});

test('the sky is black, and the white point is the 99.99 % quantile', () => {
  // An exponential disk on a sky of 5 without noise.
  const side = 64, channel = new Float64Array(side * side).fill(5);
  for (let i = 0; i < channel.length; ++i) {
    const r = Math.hypot(i % side - 31.5, Math.floor(i / side) - 31.5);
    if (r < 20) channel[i] += Math.exp(-r / 4);
  }
  const tone = automaticTone([channel], side);
  near(tone.black[0], 5, 1e-12);
  near(level('asinh', tone.white, tone.slope, tone.white), 1, 1e-12);
  // The brightest of the 1240 pixels with light.
  near(tone.white, Math.max(...channel) - 5, 1e-9);
});

test('the faintest light or the middle of a galaxy decides the slope', () => {
  // Profiles and slopes are those of tests/image/picture_test.cc.
  const side = 64, channel = new Float64Array(side * side);
  for (const [profile, isDisk, slope] of [[(r) => Math.exp(-r) + 0.05 * Math.exp(-r / 6), false, 342.7922272],
                                          [(r) => Math.exp(-r / 4), true, 4.8061858853]]) {
    for (let i = 0; i < channel.length; ++i) {
      const r = Math.hypot(i % side - 31.5, Math.floor(i / side) - 31.5);
      channel[i] = r < 20 ? profile(r) : 0;
    }
    const tone = automaticTone([channel], side);
    const lit = [...channel].filter((value) => value > 0).sort((a, b) => b - a);
    const total = lit.reduce((a, b) => a + b);
    let sum = 0;
    // 80 % of the light is in these pixels.
    const bright = lit.findIndex((value) => (sum += value) >= 0.8 * total) + 1;
    const levels = [bright - 1, Math.trunc(0.2 * bright)].map((i) => level('asinh', lit[i], tone.slope, tone.white));
    near(levels[isDisk ? 1 : 0], isDisk ? 0.54 : 0.28, 1e-9);
    assert.ok(levels[isDisk ? 0 : 1] < (isDisk ? 0.28 : 0.54));
    near(tone.slope, slope, 1e-6 * slope);
  }
  // The ten brightest of 3000 pixels hold 80 % of the light. They are no middle.
  channel.fill(0);
  for (let i = 0; i < 3000; ++i) channel[i] = i < 20 ? 1000 / Math.max(i, 1) : 0.05;
  const {slope, white} = automaticTone([channel], side);
  near(level('asinh', 1000 / 9, slope, white), 0.28, 1e-9);
});

test('channels become light per unit wavelength', () => {
  const planes = [[8000, 25], [4000, 25], [6000, 26]].map(([wavelength, zero_point]) => ({wavelength, zero_point}));
  const light = [1, 4, 10 ** -0.4 * 16 / 9], mean = Math.cbrt(light[0] * light[1] * light[2]);
  const weights = channelWeights(planes.map((plane) => plane.wavelength));
  nearAll(channelFactors(planes, weights), [light[0], light[2], light[1]].map((one) => one / mean), 1e-12);
  assert.deepEqual(channelFactors([{...planes[0], zero_point: null}, planes[1], planes[2]], weights), [1, 1, 1]);
  assert.deepEqual(channelFactors([planes[0]], [[1], [1], [1]]), [1, 1, 1]);
  // The balance follows from the light of each channel times its factor.
  const side = 64, disk = Float64Array.from({length: side * side}, (_, i) =>
      Math.exp(-Math.hypot(i % side - 31.5, Math.floor(i / side) - 31.5) / 4));
  const scaled = (factor) => disk.map((value) => value * factor);
  const tone = automaticTone([scaled(1), scaled(1), scaled(1)], side, [0.5, 1, 2]);
  near(tone.factor[0] / tone.factor[2], (0.5 / 2) ** 0.5, 1e-12);
});

test('red regions do not make the rest green, with noise or without', () => {
  // Squares of four pixels, a sixteenth of the area, are five times as red. Half of the image is black.
  const side = 128;
  for (const noise of [0, 0.05]) {
    let state = 1;
    const random = () => (state = (state * 48271) % 2147483647) / 2147483647 - 0.5;
    const image = (value) => Float64Array.from({length: side * side}, (_, i) => {
      const x = i % side, y = Math.floor(i / side);
      return (y < side / 2 ? value(x, y) : 0) + noise * random();
    });
    const tone = automaticTone([image((x, y) => x % 16 < 4 && y % 16 < 4 ? 10 : 2), image(() => 1.5), image(() => 1)],
                               side);
    near(tone.factor[1] * 1.5 / Math.sqrt(tone.factor[0] * 2 * tone.factor[2]), 1, noise > 0 ? 4e-3 : 1e-12);
  }
});

test('the PSF is a Gaussian integrated over pixels', () => {
  // Differences of erf, from Python's math.erf.
  const kernel = gaussianKernel(2);
  const whole = [0.443940824343, 0.239341311945, 0.0370657881104, 0.00160362088556];
  const total = whole[0] + 2 * whole.slice(1).reduce((a, b) => a + b);
  nearAll(kernel, whole.map((weight) => weight / total), 1e-9);
  assert.equal(seeingOf({psf: 0, noise: 0}, 1), null);
  assert.equal(seeingOf({psf: 0, noise: 4}, 0.25).noise, 1);
});

// --- camera

const camera = {projection: 'orthographic', position: [0, 0, 10], target: [0, 0, 0], up: [0, 1, 0], width: 2,
                fov: 45, center: [10, 60], pixel_scale: 0.36, rotation: 0};

test('an orbit keeps the distance, and a full turn returns', () => {
  let moved = camera;
  for (let i = 0; i < 8; ++i) moved = view.orbit(moved, Math.PI / 4, 0);
  nearAll(moved.position, camera.position, 1e-7);
  const tilted = view.orbit(camera, 0.3, 0.4);
  near(view.length(tilted.position), 10, 1e-7);
  near(tilted.position[1], 10 * Math.sin(0.4), 1e-7);
  assert.ok(tilted.position[0] < 0, 'a drag to the right moves the camera to the left');
});

test('an orbit stops before the poles', () => {
  const up = view.orbit(camera, 0, 3);
  assert.ok(up.position[1] > 9.99 && up.position[1] < 10);
  const {right} = view.basis(up);
  nearAll(right, [1, 0, 0], 1e-6);
});

test('a panned point follows the pointer', () => {
  for (const projection of ['orthographic', 'perspective']) {
    const before = view.orbit({...camera, projection}, 0.5, 0.2);
    const point = view.pointAt(before, 0.1, -0.2);
    const after = view.pan(before, 0.25, 0.1, 512);
    nearAll(view.pointAt(after, 0.35, -0.1), point, 1e-6);
    nearAll(view.pointAt(view.centre(before, 0.1, -0.2, 512), 0, 0), point, 1e-6);
    nearAll(view.pointAt(view.zoomAt(before, 0.5, 0.1, -0.2, 512), 0.1, -0.2), point, 1e-6);
  }
});

test('a sky view pans in right ascension and declination', () => {
  const sky = {...camera, projection: 'sky'};
  // 1000 pixels of 0.36 arcsec are 0.1 deg; North is up, and East is to the left.
  const up = view.pan(sky, 0, -1, 1000);
  nearAll(up.center, [10, 60.1], 1e-7);
  const left = view.pan(sky, 1, 0, 1000);
  nearAll(left.center, [10.2, 60], 1e-6);
  const turned = view.pan({...sky, rotation: 90}, 0, -1, 1000);
  nearAll(turned.center, [10.2, 60], 1e-6);
  assert.deepEqual(Object.keys(view.cameraSettings(sky)),
                   ['camera.projection', 'camera.center', 'camera.pixel_scale', 'camera.rotation']);
});

test('the sky under a pixel is that of Astropy', () => {
  const header = {CRVAL1: 150.1, CRVAL2: -62.3, CRPIX1: 64.5, CRPIX2: 32.5, CD1_1: -0.02, CD1_2: 0.005, CD2_1: 0.005, CD2_2: 0.02};
  const expected = {  // astropy.wcs.WCS.wcs_pix2world of the pixel (1, 1)
    TAN: [152.56959182498363, -63.226007916817174], SIN: [152.5704205483075, -63.22630194294458],
    ARC: [152.57014417953488, -63.22620389014123], STG: [152.57000604978157, -63.22615488267254],
    ZEA: [152.570213256381, -63.22622839800971]};
  for (const [name, [ra, dec]] of Object.entries(expected)) {
    const sky = skyOf({...header, CTYPE1: `RA---${name}`, CTYPE2: `DEC--${name}`});
    const at = sky(1, 1);
    near(at.ra, ra, 1e-10, name);
    near(at.dec, dec, 1e-10, name);
  }
  assert.equal(skyOf({...header, CTYPE1: 'RA---AIT'}), null);
  assert.equal(skyOf(null), null);
});

// --- key frames

test('the path is exact for parabolas and passes through its key frames', () => {
  const times = [0, 1, 2.5, 4], parabola = (t) => 2 - t + 0.5 * t * t;
  const path = smoothPath(times, times.map(parabola));
  for (const t of [0, 0.3, 1, 1.7, 2.5, 3.9, 4]) near(path(t), parabola(t), 1e-12);
  nearAll(smoothPath([0, 2], [[0, 1], [4, 1]])(0.5), [1, 1], 1e-12);
});

test('a film has its keys as settings', () => {
  const keys = [{time: 0, camera}, {time: 50, camera: {...camera, position: [0, 10, 0], up: [0, 0, 1], width: 8}}];
  near(cameraAt(keys, 25).width, 4, 1e-12);
  const settings = animationSettings(keys, 51);
  assert.deepEqual(settings['animation.position'], [0, 0, 10, 0, 10, 0]);
  assert.deepEqual(settings['animation.width'], [2, 8]);
  assert.deepEqual(settings['animation.up'], [0, 1, 0, 0, 0, 1]);
  assert.equal(settings['animation.frames'], 51);
  assert.equal(animationProblem(keys), '');
  assert.notEqual(animationProblem(keys.slice(1)), '');
});

test('up turns from key frame to key frame and stays across the view', () => {
  const keys = [{time: 0, camera: {...camera, position: [0, -8, 6], up: [0, 0, 1]}},
                {time: 1, camera: {...camera, position: [0, 0, 10], up: [0, 1, 0]}},
                {time: 3, camera: {...camera, position: [10, 0, 0], up: [0, -1, 0]}}];
  for (const {time, camera: key} of keys) {
    const at = cameraAt(keys, time);
    nearAll(view.basis(at).right, view.basis(key).right, 1e-12);
    nearAll(view.basis(at).up, view.basis(key).up, 1e-12);
  }
  for (let time = 0; time <= 3; time += 0.1) {
    const at = cameraAt(keys, time);
    near(view.length(at.up), 1, 1e-12);
    near(view.dot(at.up, view.basis(at).back), 0, 1e-12);
  }
});

// --- orientations

test('rows with an inclination turn with the camera', () => {
  assert.equal(hasInclination('galaxy x inclination\nm51 0 -\nlmc 0 30\n'), true);
  assert.equal(hasInclination('galaxy x inclination\nm51 0 -\n'), false);
  assert.equal(hasInclination('galaxy axis_ratio ox oy oz\nsersic 0.5 1 0 0\n'), false);
  assert.equal(hasInclination('galaxy x\nm51 0\n'), false);
  assert.deepEqual(poleOf('galaxy ox oy oz\nlmc 1 2 3\nm51 0 -1 0.5\n', 'm51'), [0, -1, 0.5]);
  assert.deepEqual(poleOf('galaxy ox oy oz\nm51 - - -\n', 'm51'), [0, 0, 1]);
  assert.deepEqual(poleOf('galaxy x\nm51 0\n', 'lmc'), [0, 0, 1]);
});

test('directions go along with the pole', () => {
  nearAll(view.alongPole([0, 0, 1], [3, -4, 12]), [3 / 13, -4 / 13, 12 / 13], 1e-15);
  // The turn keeps its line of nodes.
  nearAll(view.alongPole([4, 3, 0], [3, -4, 12]), [4, 3, 0], 1e-14);
  nearAll(view.alongPole([1, 2, 3], [0, 0, 5]), [1, 2, 3], 0);
  nearAll(view.alongPole([1, 2, 3], [0, 0, -1]), [1, -2, -3], 0);
});

test('which moves of the camera turn galaxies with an inclination', () => {
  const flat = {projection: 'orthographic', position: [0, -3, 4], target: [0, 0, 0], up: [0, 0, 1], width: 2};
  const deep = {...flat, projection: 'perspective', fov: 30};
  assert.equal(view.turnsGalaxies(flat, view.pan(flat, 0.1, 0.2, 512)), false);
  assert.equal(view.turnsGalaxies(flat, view.zoom(flat, 2)), false);
  assert.equal(view.turnsGalaxies(flat, view.orbit(flat, 0.1, 0)), true);
  assert.equal(view.turnsGalaxies(flat, view.roll(flat, 0.1)), true);
  assert.equal(view.turnsGalaxies(deep, view.pan(deep, 0.1, 0.2, 512)), true);
  assert.equal(view.turnsGalaxies({projection: 'sky'}, {projection: 'sky'}), false);
});

test('four planes make a texel, and what is not finite is dark', () => {
  const values = Float32Array.of(1, 2, 3, NaN, 5, 6, 7, Infinity, 9, 10);
  assert.deepEqual([...packTexels(values, 2, 0)], [1, 3, 5, 7, 2, 0, 6, 0]);
  assert.deepEqual([...packTexels(values, 2, 1)], [9, 0, 0, 0, 10, 0, 0, 0]);
});

test('planes whose weights change alike are one group', () => {
  const base = [[1, 0, 0], [0, 2, 0], [0, 0, 3], [0, 0, 0]];
  assert.deepEqual(planeGroups(base, base), {factors: [1, 0], groups: [0, 0, 0, 0]});
  const moved = [[0.5, 0, 0], [0, 3, 0], [0, 0, 1.5], [0, 0, 0]];
  assert.deepEqual(planeGroups(base, moved), {factors: [0.5, 1.5], groups: [0, 1, 0, 0]});
  // Shares that agree in six digits are equal; shares that differ by more are not.
  assert.deepEqual(planeGroups(base, [[1, 0, 0], [0, 2.00001, 0], [0, 0, 3], [0, 0, 0]]).groups, [0, 0, 0, 0]);
  assert.deepEqual(planeGroups(base, [[1, 0, 0], [0, 2.0003, 0], [0, 0, 3], [0, 0, 0]]).groups, [0, 1, 0, 0]);
  // No groups: three factors, a changed channel, light in a plane that had none, or a missing
  // plane.
  assert.equal(planeGroups(base, [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]]), null);
  assert.equal(planeGroups(base, [[0, 1, 0], [0, 2, 0], [0, 0, 3], [0, 0, 0]]), null);
  assert.equal(planeGroups(base, [[1, 0, 0], [0, 2, 0], [0, 0, 3], [1, 0, 0]]), null);
  assert.equal(planeGroups(base, base.slice(1)), null);
});
