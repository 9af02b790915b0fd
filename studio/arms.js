// Tools that add, clone, delete and move arms of their own, the tables [[arm]].

import {h, tool} from './dom.js';

export class ArmTools {
  constructor(app) { this.app = app; }

  get count() { return this.app.doc.model?.arms?.length ?? 0; }

  /// The button above the arms, which adds an arm or makes the first ones.
  head(box) {
    const first = this.count === 0;
    const text = first ? 'Arms of their own' : 'Add an arm';
    const title = first ? 'Write each arm of the pattern as a table of its own, [[arm]]' : 'An arm in the widest gap between the others';
    box.append(h('div', {class: 'arm-head'}, h('button', {type: 'button', class: 'chip', title, onclick: () => this.add()}, text)));
  }

  /// The tools of one arm.
  tools(group, i) {
    group.append(h('div', {class: 'tools arm-tools', role: 'toolbar', 'aria-label': `Arm ${i + 1}`},
        tool('clone', `Clone arm ${i + 1}`, '', () => this.clone(i)),
        tool('remove', `Delete arm ${i + 1}`, '', () => this.remove(i)),
        tool('up', `Move arm ${i + 1} up`, '', () => this.move(i, i - 1)),
        tool('down', `Move arm ${i + 1} down`, '', () => this.move(i, i + 1))));
  }

  add() {
    return this.app.doc.edit([{add_arm: true}], this.count === 0 ? 'arms of their own' : 'add an arm');
  }

  clone(i) { return this.app.doc.edit([{clone_arm: i}], `clone arm ${i + 1}`); }
  remove(i) { return this.app.doc.edit([{delete_arm: i}], `delete arm ${i + 1}`); }

  move(from, to) {
    if (to < 0 || to >= this.count) return null;
    return this.app.doc.edit([{move_arm: [from, to]}], `move arm ${from + 1}`);
  }
}
