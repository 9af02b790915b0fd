// The state of the page apart from the document: camera, mutes, stretch, panels, key frames. It
// survives a reload, and undo leaves it alone.

const place = 'gstudio';

function newLook() {
  return {mode: 'lupton', slope: 1, white: 1, black: 0, exposure: 0, contrast: 1, gamma: 1, saturation: 1, psf: 0, noise: 0,
          pixels: false, auto: true};
}

function initial(camera) {
  return {camera, muted: {}, solo: {}, look: newLook(), tone: null, channels: null, selected: {}, row: 0,
          tab: 'component', dock: 'light', left: true, right: true, filter: 'all', keys: [],
          frames: 120, side: 512, folded: {}};
}

/// Events: `camera` (detail.moving), `muted`, `look`, `panels`, `selected`, `keys`.
export class UiState extends EventTarget {
  constructor(camera, kept) {
    super();
    Object.assign(this, initial(camera), kept ?? {});
    this.look = {...newLook(), ...this.look};
  }

  say(name, detail = {}) { this.dispatchEvent(new CustomEvent(name, {detail})); }

  setCamera(camera, moving) {
    this.camera = camera;
    this.say('camera', {moving});
  }

  isMuted(galaxy, name) {
    const solo = this.solo[galaxy];
    return solo ? solo !== name : (this.muted[galaxy] ?? []).includes(name);
  }

  toggleMute(galaxy, name) {
    const muted = new Set(this.muted[galaxy] ?? []);
    if (!muted.delete(name)) muted.add(name);
    this.muted[galaxy] = [...muted];
    this.say('muted');
  }

  toggleSolo(galaxy, name) {
    this.solo[galaxy] = this.solo[galaxy] === name ? null : name;
    this.say('muted');
  }

  keep() {
    return Object.fromEntries(Object.keys(initial(null)).map((key) => [key, this[key]]));
  }
}

/// The state that the last page of this tab kept, or null.
export function restore() {
  try {
    return JSON.parse(sessionStorage.getItem(place));
  } catch {
    return null;
  }
}

/// Keeps the page's state. Where the browser's room is too small, the oldest steps of undo go first.
export function store(doc, ui) {
  for (const most of [Infinity, 200, 50, 10, 1]) {
    try {
      sessionStorage.setItem(place, JSON.stringify({document: doc.keep(most), ui: ui.keep()}));
      return;
    } catch { /* no room */ }
  }
}
