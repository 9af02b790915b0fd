// One parameter as a row: label, value, slider or choice, reset. It is made from a declaration.

import {h, icon} from './dom.js';
import {positionOf, sliderScale, text, valueAt} from './scale.js';

const resolution = 1000;
// Units that are too long for a row; tooltips have the whole.
const shortUnits = {'galaxy radii': 'radii', '1/galaxy radii': '1/radius', 'cycles per galaxy radius': '1/radius'};
let count = 0;

/// `actions` has preview(value), commit(value) and reset(to the file or default). Its show() takes
/// {value, given, first, useless}: the value as resolved, whether the file gives it, the value in
/// the file the galaxy began with, and why the parameter does not matter.
export class ParameterRow {
  constructor(declared, actions, words = null) {
    this.declared = declared;
    this.actions = actions;
    this.id = `parameter-${++count}`;
    this.reset = h('button', {type: 'button', class: 'reset', onclick: () => actions.reset()}, icon('reset'));
    const unit = declared.unit ? h('span', {class: 'unit', title: declared.unit}, shortUnits[declared.unit] ?? declared.unit) : null;
    this.label = h('label', {for: this.id, title: this.tip()}, declared.label ?? declared.name);
    this.element = h('div', {class: this.isNumber || declared.type === 'boolean' ? 'row' : 'row words', 'data-key': declared.name},
                     this.label, unit, ...this.controls(words), this.reset);
  }

  tip() {
    const {description, unit, min, max, min_open, max_open, choices} = this.declared;
    const default_ = this.declared.default;
    const bound = (x, other) => x === null || x === undefined ? other : text(x);
    const interval = min !== null && min !== undefined || max !== null && max !== undefined ?
        `${min_open ? ']' : '['}${bound(min, '-∞')}, ${bound(max, '∞')}${max_open ? '[' : ']'}` : '';
    const facts = [interval, unit, choices?.length ? choices.join(', ') : '',
                   default_ !== null && default_ !== undefined ? `default ${this.textOf(default_)}` : ''];
    return `${description}\n${facts.filter(Boolean).join(' · ')}`;
  }

  textOf(value) {
    if (value === null || value === undefined) return '';
    return Array.isArray(value) ? value.map(text).join(', ') : text(value);
  }

  get isNumber() { return this.declared.type === 'number' || this.declared.type === 'integer'; }

  controls(words) {
    const {type, choices} = this.declared;
    if (type === 'boolean') {
      this.input = h('input', {type: 'checkbox', id: this.id, onchange: () => this.commit(this.input.checked)});
      return [this.input];
    }
    if (type === 'choice' && choices?.length) {
      const none = this.declared.default === null ? [h('option', {value: ''}, 'automatic')] : [];
      this.input = h('select', {id: this.id, onchange: () => this.commit(this.input.value || null)},
                     none, choices.map((word) => h('option', {value: word}, word)));
      return [this.input];
    }
    this.input = h('input', {type: 'text', id: this.id, inputMode: this.isNumber ? 'decimal' : 'text',
                             autocomplete: 'off', spellcheck: false, onchange: () => this.typed(),
                             onkeydown: (event) => this.leave(event)});
    if (words?.length) {
      const list = h('datalist', {id: `${this.id}-words`}, words.map((word) => h('option', {value: word})));
      this.input.setAttribute('list', list.id);
      return [this.input, list];
    }
    if (!this.isNumber || /seed$/.test(this.declared.name)) return [this.input];
    this.slider = h('input', {type: 'range', class: 'slider', min: 0, max: resolution, step: 1,
                              'aria-label': this.declared.label ?? this.declared.name, title: this.tip(),
                              oninput: () => this.slide(false), onchange: () => this.slide(true),
                              onkeydown: (event) => this.key(event)});
    return [this.input, this.slider];
  }

  /// Escape drops the typed value. Enter takes it, and leaves the field so that the keys of the
  /// page work again.
  leave(event) {
    if (event.key === 'Escape') {
      this.write();
      this.input.blur();
    } else if (event.key === 'Enter' && this.parse(this.input.value.trim()) !== undefined) {
      if (this.slider) this.slider.focus();
      else this.input.blur();
    }
  }

  /// Arrow keys move by a hundredth of the slider, with Shift by a tenth.
  key(event) {
    const step = {ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageUp: 10, PageDown: -10}[event.key];
    if (!step) return;
    event.preventDefault();
    const {integer, low, high} = this.scale;
    const least = integer ? Math.max(resolution / (high - low), 10) : 10;
    this.slider.value = Number(this.slider.value) + step * (event.shiftKey ? 10 : 1) * least;
    this.slide(true);
  }

  slide(isDone) {
    const value = valueAt(this.scale, Number(this.slider.value) / resolution);
    this.isSliding = !isDone;
    this.input.value = this.textOf(value);
    this.fill(value);
    if (isDone) this.actions.commit(value);
    else this.actions.preview(value);
  }

  typed() {
    const value = this.parse(this.input.value.trim());
    if (value === undefined) {
      this.input.setAttribute('aria-invalid', 'true');
      return;
    }
    this.commit(value);
  }

  /// The typed value, null for an empty one, undefined for none that the type allows.
  parse(typed) {
    const {type} = this.declared;
    if (typed === '') return null;
    if (['text', 'choice'].includes(type)) return typed;
    const parts = typed.split(/[\s,;]+/).filter(Boolean);
    if (type === 'texts') return parts;
    const numbers = parts.map(Number);
    if (numbers.some((number) => !Number.isFinite(number))) return undefined;
    if (this.isNumber) {
      return numbers.length === 1 && (type !== 'integer' || Number.isInteger(numbers[0])) ? numbers[0] : undefined;
    }
    return type === 'size2' && numbers.length === 1 ? numbers[0] : numbers;
  }

  commit(value) {
    this.input.removeAttribute('aria-invalid');
    if (value === null) this.actions.reset(true);
    else this.actions.commit(value);
  }

  fill(value) {
    this.slider.style.setProperty('--fill', `${100 * positionOf(this.scale, value)}%`);
    this.slider.setAttribute('aria-valuetext', `${this.textOf(value)} ${this.declared.unit ?? ''}`.trim());
  }

  show(state) {
    this.state = state;
    const {given, value, first, useless = null} = state;
    this.element.classList.toggle('useless', useless !== null);
    for (const control of [this.input, this.slider]) {
      if (control) control.disabled = useless !== null;
    }
    const tip = useless === null ? this.tip() : `${useless}\n${this.tip()}`;
    if (this.label.title !== tip) this.label.title = tip;
    if (useless === null) this.input.removeAttribute('title');
    else this.input.title = useless;
    const isChanged = JSON.stringify(value ?? null) !== JSON.stringify(first ?? null);
    this.element.classList.toggle('given', given);
    this.element.classList.toggle('changed', isChanged);
    this.reset.hidden = !isChanged && !given;
    const back = isChanged ? `Back to the file: ${this.textOf(first) || 'not given'}` :
        `Back to the default${this.declared.default === null || this.declared.default === undefined ? '' : `: ${this.textOf(this.declared.default)}`}`;
    this.reset.title = back;
    this.reset.setAttribute('aria-label', `${this.declared.name}: ${back}`);
    if (!this.isSliding) this.write();
  }

  /// Writes the value into the controls, unless it is being typed.
  write() {
    const {value} = this.state, shown = value ?? this.declared.default;
    this.input.removeAttribute('aria-invalid');
    if (this.declared.type === 'boolean') {
      this.input.checked = shown === true;
      return;
    }
    if (this.declared.type === 'choice' && this.declared.choices?.length) {
      this.input.value = shown ?? '';
      return;
    }
    if (document.activeElement !== this.input || this.lastValue !== JSON.stringify(value)) this.input.value = this.textOf(shown);
    this.lastValue = JSON.stringify(value);
    this.input.placeholder = shown === null || shown === undefined ? 'automatic' : '';
    if (!this.slider) return;
    const number = typeof shown === 'number' ? shown : null;
    this.scale = sliderScale(this.declared, number);
    const at = number === null ? 0 : positionOf(this.scale, number);
    this.slider.value = Math.round(at * resolution);
    this.fill(number ?? this.scale.low);
    this.slider.classList.toggle('unset', number === null);
  }
}
