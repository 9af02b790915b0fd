// Elements and icons.

/// An element with properties, attributes (`aria-label`, `role`), listeners (`onclick`) and children.
export function h(name, properties = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(properties)) {
    if (value === undefined || value === null) continue;
    if (key.startsWith('on')) element.addEventListener(key.slice(2), value);
    else if (key.includes('-') || key === 'role' || key === 'for') element.setAttribute(key, value);
    else if (key === 'class') element.className = value;
    else element[key] = value;
  }
  element.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
  return element;
}

export const $ = (id) => document.getElementById(id);

/// Gives a canvas a size, unless it has it.
export function sizeTo(canvas, width, height) {
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
}

/// The context of a small drawing on the processor, which takes less time than to prepare a GPU.
export const flatInk = (canvas) => canvas.getContext('2d', {willReadFrequently: true});

const paths = {
  add: 'M8 3v10M3 8h10',
  clone: 'M6 6h7v7H6zM3 10V3h7',
  remove: 'M3.5 5h9M6 5V3h4v2M5 5l.6 8h4.8L11 5',
  up: 'M8 13V3M4 7l4-4 4 4',
  down: 'M8 3v10M4 9l4 4 4-4',
  dice: 'M3 3h10v10H3zM6 6h.01M10 10h.01M10 6h.01M6 10h.01',
  sheet: 'M3 3h2.5v2.5H3zM6.8 3h2.5v2.5H6.800zM10.600 3h2.500v2.500h-2.500zM3 6.800h2.500v2.500H3zM6.800 6.800h2.500v2.500H6.800zM10.600 6.800h2.500v2.500h-2.500zM3 10.600h2.500v2.500H3zM6.800 10.600h2.500v2.500H6.800zM10.600 10.600h2.500v2.500h-2.500z',
  undo: 'M5 3L2 6l3 3M2 6h7a4 4 0 0 1 0 8H6',
  redo: 'M11 3l3 3-3 3M14 6H7a4 4 0 0 0 0 8h3',
  folder: 'M2 4h4l1.500 2H14v7H2z',
  save: 'M3 3h8l2 2v8H3zM5.500 3v3.500h4V3M5 13V9h6v4',
  film: 'M2 4h12v8H2zM5 4v8M11 4v8M2 8h3M11 8h3',
  play: 'M5 3l8 5-8 5z',
  stop: 'M4 4h8v8H4z',
  render: 'M8 2.500l5 2.800v5.400L8 13.500l-5-2.800V5.300zM3 5.300l5 2.800 5-2.800M8 8.100v5.400',
  copy: 'M3 4h10M3 8h6M3 12h8',
  picture: 'M2 3h12v10H2zM2 11l4-4 3 3 2-2 3 3M10.500 6h.01',
  reset: 'M4 4a5.500 5.500 0 1 1-1.500 4M4 1.500V4.500h3',
  help: 'M6 6a2 2 0 1 1 2.800 1.800c-.6.3-.8.7-.8 1.400M8 11.800h.01',
  key: 'M8 2.500l4 5.500-4 5.500L4 8z',
  left: 'M2 3h12v10H2zM6 3v10',
  right: 'M2 3h12v10H2zM10 3v10',
  lock: 'M4 7h8v6H4zM5.500 7V5a2.500 2.500 0 0 1 5 0v2',
  centre: 'M8 2v4M8 10v4M2 8h4M10 8h4',
};

/// A line icon of 16 x 16 that inherits the colour of the text.
export function icon(name) {
  const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
  svg.setAttribute('viewBox', '0 0 16 16');
  svg.setAttribute('class', 'icon');
  svg.setAttribute('aria-hidden', 'true');
  const path = document.createElementNS('http://www.w3.org/2000/svg', 'path');
  path.setAttribute('d', paths[name]);
  svg.append(path);
  return svg;
}

/// A button with an icon; `label` is its name and, with its key, the tooltip.
export function tool(name, label, key, onclick, text = '') {
  return h('button', {type: 'button', class: text ? 'tool wide' : 'tool', 'aria-label': label,
                      title: key ? `${label} (${key})` : label, onclick}, icon(name),
           text ? h('span', {}, text) : null);
}

/// A choice: label and <select> of [value, text].
export function choice(label, options, value, onchange, title = '') {
  const select = h('select', {'aria-label': label, title, onchange: () => onchange(select.value)},
                   options.map(([key, text]) => h('option', {value: key}, text)));
  select.value = value;
  return select;
}

/// Asks the browser to store text or a blob as a file.
export function download(blob, name) {
  const link = h('a', {href: URL.createObjectURL(blob), download: name});
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
