// Keys of the page, and the help that lists them.

import {h} from './dom.js';
import {dialog} from './messages.js';

function nameOf(event) {
  const parts = [];
  if (event.ctrlKey || event.metaKey) parts.push('Ctrl');
  if (event.altKey) parts.push('Alt');
  const isLetter = /^[a-z]$/i.test(event.key);
  if (event.shiftKey && (event.key.length > 1 || isLetter)) parts.push('Shift');
  const key = event.key.length === 1 ? event.key.toUpperCase() : event.key.replace('Arrow', '');
  return [...parts, key === ' ' ? 'Space' : key].join('+');
}

const isTyping = (element) => element instanceof HTMLTextAreaElement ||
    (element instanceof HTMLInputElement && element.type !== 'range' && element.type !== 'checkbox');

export class Keyboard {
  /// `commands` is a list of [group, keys, label, run].
  constructor(commands) {
    this.commands = commands;
    this.byKey = new Map(commands.flatMap(([, keys, , run]) => keys.map((key) => [key, run])));
    document.addEventListener('keydown', (event) => this.press(event));
  }

  press(event) {
    if (event.defaultPrevented || document.querySelector('dialog[open]')) return;
    const name = nameOf(event), run = this.byKey.get(name);
    if (!run) return;
    const isPlain = !event.ctrlKey && !event.metaKey && !event.altKey;
    if (isTyping(document.activeElement) && (isPlain || name === 'Ctrl+Z')) return;
    const onButton = document.activeElement instanceof HTMLButtonElement || document.activeElement instanceof HTMLSelectElement;
    if (name === 'Space' && onButton) return;
    if (isPlain && document.activeElement instanceof HTMLSelectElement) return;
    event.preventDefault();
    run();
  }

  help() {
    const groups = new Map();
    for (const [group, keys, label] of this.commands) {
      if (!groups.has(group)) groups.set(group, []);
      groups.get(group).push([keys, label]);
    }
    dialog('Keys', h('div', {class: 'keys'}, [...groups].map(([group, list]) =>
        h('section', {}, h('h3', {}, group), h('dl', {}, list.map(([keys, label]) =>
            [h('dt', {}, keys.map((key) => h('kbd', {}, key))), h('dd', {}, label)]))))), 'wide');
  }
}
