// Short messages at the edge of the page, and dialogs.

import {$, h} from './dom.js';

const shownMs = 6000;

/// Shows a message for a while; `kind` is 'note' or 'problem'. `action` is [label, function].
export function say(text, kind = 'note', action = null) {
  const box = h('div', {class: `message ${kind}`}, h('span', {}, text));
  if (action) box.append(h('button', {type: 'button', onclick: () => { action[1](); box.remove(); }}, action[0]));
  box.append(h('button', {type: 'button', class: 'close', 'aria-label': 'Close the message', onclick: () => box.remove()}, '×'));
  const same = [...$('messages').children].find((other) => other.firstChild.textContent === text);
  same?.remove();
  $('messages').append(box);
  while ($('messages').children.length > 4) $('messages').firstChild.remove();
  const wait = () => setTimeout(() => box.matches(':hover, :focus-within') ? wait() : box.remove(), shownMs);
  wait();
}

/// A modal dialog with a title and content. Returns it with close(); Escape closes it.
export function dialog(title, content, className = '') {
  const box = h('dialog', {class: className, 'aria-label': title});
  const close = () => { box.close(); box.remove(); };
  box.append(h('header', {}, h('h2', {}, title),
                h('button', {type: 'button', class: 'close', 'aria-label': 'Close', onclick: close}, '×')), content);
  box.addEventListener('close', () => box.remove());
  document.body.append(box);
  box.showModal();
  (content.querySelector('[autofocus], input, button') ?? box).focus();
  return {box, close};
}

/// Asks for a text; the promise is null where the dialog is closed without one. `words` are offered.
export function ask(title, label, value, button, words = []) {
  return new Promise((resolve) => {
    const input = h('input', {type: 'text', value, id: 'asked', autocomplete: 'off', spellcheck: false});
    const form = h('form', {method: 'dialog'}, h('label', {for: 'asked'}, label), input,
                   h('datalist', {id: 'asked-words'}, words.map((word) => h('option', {value: word}))),
                   h('div', {class: 'buttons'}, h('button', {class: 'main'}, button)));
    if (words.length > 0) input.setAttribute('list', 'asked-words');
    let answer = null;
    form.addEventListener('submit', () => { answer = input.value.trim() || null; });
    const {box} = dialog(title, form, 'small');
    box.addEventListener('close', () => resolve(answer));
    input.select();
  });
}

/// Asks whether to go on; the promise is false where the dialog is closed otherwise.
export function confirm(title, text, button) {
  return new Promise((resolve) => {
    let isSure = false;
    const form = h('form', {method: 'dialog'}, h('p', {}, text),
                   h('div', {class: 'buttons'}, h('button', {class: 'main', autofocus: true}, button)));
    form.addEventListener('submit', () => { isSure = true; });
    dialog(title, form, 'small').box.addEventListener('close', () => resolve(isSure));
  });
}
