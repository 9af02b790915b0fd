// The rows of a scene list, as a text has them. The server edits the text.

const none = '-';

/// Words of a line outside of comments.
function wordsOf(line) {
  const words = line.trim().split(/[ \t]+/).filter(Boolean);
  const comment = words.findIndex((word) => word.startsWith('#'));
  return comment < 0 ? words : words.slice(0, comment);
}

/// Names of the columns, and the words of each row.
export function rowsOf(scene) {
  const lines = scene.split('\n').map(wordsOf).filter((words) => words.length > 0);
  return {columns: lines[0] ?? [], rows: lines.slice(1)};
}

/// Whether a row has an inclination or axis ratio, relative to the camera, and no `ox oy oz`.
export function hasInclination(scene) {
  const {columns, rows} = rowsOf(scene);
  const places = ['inclination', 'axis_ratio'].map((name) => columns.indexOf(name)).filter((place) => place >= 0);
  const isFree = columns.indexOf('ox');
  return rows.some((row) => places.some((place) => (row[place] ?? none) !== none) && (row[isFree] ?? none) === none);
}

/// The axis of the first row of a galaxy, or z, the axis of rows without `ox oy oz`.
export function poleOf(scene, galaxy) {
  const {columns, rows} = rowsOf(scene);
  const row = rows.find((words) => words[columns.indexOf('galaxy')] === galaxy) ?? [];
  const pole = ['ox', 'oy', 'oz'].map((name) => Number(row[columns.indexOf(name)] ?? NaN));
  return pole.every(Number.isFinite) && pole.some((part) => part !== 0) ? pole : [0, 0, 1];
}

/// The value of a word: a number where the column has numbers, null for none.
export function valueOf(word, type) {
  if (word === undefined || word === none) return null;
  const number = Number(word);
  return (type === 'number' || type === 'integer') && Number.isFinite(number) ? number : word;
}

/// Declarations of the columns: those of the list in its order, and the others. A column that is
/// not declared is a parameter of the row's galaxy.
export function columnsOf(names, declared) {
  const known = new Map(declared.map((one) => [one.name, one]));
  const other = (name) => ({name, type: 'text', unit: '', default: null, description: 'parameter of the row\'s galaxy'});
  return {own: names.map((name) => known.get(name) ?? other(name)),
          others: declared.filter(({name}) => !names.includes(name))};
}

/// The rows that a list of `height` pixels shows, scrolled by `top`: [first, one behind the last].
export function visibleRows(top, height, rowHeight, count) {
  const first = Math.max(Math.floor(top / rowHeight) - 2, 0);
  return [Math.min(first, count), Math.min(Math.ceil((top + height) / rowHeight) + 2, count)];
}

/// The row to choose when one is gone.
export const rowAfterDelete = (row, count) => Math.max(Math.min(row, count - 2), 0);
