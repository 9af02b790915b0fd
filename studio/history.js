// Undo and redo without end: a list of states, of which one is shown. States are never changed.

export class History {
  constructor(state) {
    this.states = [{state, label: ''}];
    this.at = 0;
    this.key = null;
  }

  get state() { return this.states[this.at].state; }
  get canUndo() { return this.at > 0; }
  get canRedo() { return this.at + 1 < this.states.length; }
  get undoLabel() { return this.canUndo ? this.states[this.at].label : ''; }
  get redoLabel() { return this.canRedo ? this.states[this.at + 1].label : ''; }

  /// Adds a state after the one shown; states that were undone are gone. A state with the key of
  /// the one before replaces it: a key pressed ten times is one step.
  commit(state, label, key = null) {
    const merged = key !== null && key === this.key && this.at > 0;
    this.states.length = this.at + 1;
    if (merged) {
      this.states[this.at] = {state, label};
    } else {
      this.states.push({state, label});
      ++this.at;
    }
    this.key = key;
  }

  /// Ends merging: the next state is a step of its own.
  seal() { this.key = null; }

  undo() { return this.go(this.at - 1); }
  redo() { return this.go(this.at + 1); }

  go(at) {
    this.key = null;
    if (at < 0 || at >= this.states.length) return false;
    this.at = at;
    return true;
  }

  /// All states as data in which each text occurs once. `most` limits the number of states, the
  /// oldest go first.
  pack(most = Infinity) {
    const first = Math.max(0, Math.min(this.at, this.states.length - most));
    const texts = [], places = new Map();
    const place = (text) => {
      if (!places.has(text)) places.set(text, texts.push(text) - 1);
      return places.get(text);
    };
    const states = this.states.slice(first).map(({state, label}) => [place(JSON.stringify(state.settings)),
      Object.entries(state.galaxies).map(([name, text]) => [name, place(text)]), label, place(state.scene)]);
    return {at: this.at - first, texts, states};
  }

  static unpack({at, texts, states}) {
    const history = new History(null);
    history.states = states.map(([settings, galaxies, label, scene]) => ({label, state: {
      settings: JSON.parse(texts[settings]), scene: texts[scene],
      galaxies: Object.fromEntries(galaxies.map(([name, text]) => [name, texts[text]]))}}));
    history.at = at;
    return history;
  }
}
