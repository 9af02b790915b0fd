// Key frames of the camera on a time line, with play, and their film.

import {$, h, tool} from './dom.js';
import {animationProblem, animationSettings, cameraAt} from './animation.js';
import {say} from './messages.js';
import {cameraSettings} from './view.js';

const framesPerSecond = 25;

export class TimeLine {
  constructor(app) {
    this.app = app;
    this.time = 0;
    this.track = h('div', {class: 'track', role: 'slider', tabIndex: 0, 'aria-label': 'Time', 'aria-valuemin': 0,
                           onpointerdown: (event) => this.press(event), onpointermove: (event) => this.drag(event),
                           onkeydown: (event) => this.key(event)});
    this.playing = tool('play', 'Play', 'Space', () => this.toggle());
    this.frames = h('input', {type: 'text', inputMode: 'numeric', class: 'short', 'aria-label': 'Frames of the film',
                              onchange: () => this.setFrames()});
    this.clock = h('span', {class: 'note'});
    $('dock-time').append(h('div', {class: 'time-tools'}, this.playing,
        tool('key', 'Key frame of the present view', 'K', () => this.add(), 'Key frame'),
        tool('remove', 'Remove the key frame here', '', () => this.remove()),
        h('label', {class: 'inline'}, 'Frames ', this.frames), this.clock, h('span', {class: 'gap'}),
        tool('film', 'Render the film', '', () => this.film(), 'Film')), this.track);
    app.ui.addEventListener('keys', () => this.show());
    this.show();
  }

  get keys() { return this.app.ui.keys; }
  /// Length of the film in frames, the unit of time here.
  get end() { return Math.max(this.app.ui.frames - 1, 1); }

  setFrames() {
    const frames = Math.round(Number(this.frames.value));
    if (frames >= 2 && frames <= 100000) {
      const factor = (frames - 1) / this.end;
      for (const key of this.keys) key.time = key.time * factor;
      this.time *= factor;
      this.app.ui.frames = frames;
    }
    this.app.ui.say('keys');
  }

  /// Adds a key frame at this time. If another camera has a key frame at a time that was not
  /// chosen, the new one comes a quarter of the film later.
  add() {
    const {ui} = this.app;
    const time = this.keyAt(this.time) && JSON.stringify(this.keyAt(this.time).camera) !== JSON.stringify(ui.camera) && !this.isPlaced ?
        Math.min(Math.round(this.time + this.end / 4), this.end) : Math.round(this.time);
    ui.keys = [...this.keys.filter((key) => Math.abs(key.time - time) > 0.5), {time, camera: ui.camera}]
        .sort((a, b) => a.time - b.time);
    this.time = time;
    this.isPlaced = false;
    ui.dock = 'time';
    ui.say('panels');
    ui.say('keys');
  }

  keyAt(time) { return this.keys.find((key) => Math.abs(key.time - time) <= 0.5); }

  remove() {
    this.app.ui.keys = this.keys.filter((key) => Math.abs(key.time - this.time) > 0.5);
    this.app.ui.say('keys');
  }

  show() {
    this.frames.value = this.app.ui.frames;
    this.track.setAttribute('aria-valuemax', this.end);
    this.track.setAttribute('aria-valuenow', Math.round(this.time));
    const marks = this.keys.map((key, i) => {
      const mark = h('button', {type: 'button', class: 'mark', tabIndex: -1, title: `Key frame ${i + 1}, frame ${Math.round(key.time) + 1}`,
                                'aria-label': `Key frame ${i + 1}`, onclick: (event) => { event.stopPropagation(); this.go(key.time, false); }});
      mark.style.left = `${100 * key.time / this.end}%`;
      return mark;
    });
    const cursor = h('span', {class: 'now'});
    cursor.style.left = `${100 * this.time / this.end}%`;
    this.track.replaceChildren(...marks, cursor);
    this.clock.textContent = `frame ${Math.round(this.time) + 1} of ${this.app.ui.frames}, ${(this.time / framesPerSecond).toFixed(1)} s`;
  }

  /// Shows the view at a time.
  go(time, moving) {
    this.time = Math.min(Math.max(time, 0), this.end);
    this.isPlaced = true;
    if (animationProblem(this.keys) === '') {
      this.app.doc.fixOrientations(cameraSettings(this.keys[0].camera));
      const {keys} = this, first = keys[0].time, last = keys[keys.length - 1].time;
      this.app.ui.setCamera(cameraAt(keys, Math.min(Math.max(this.time, first), last)), moving);
    } else if (this.keys.length === 1 && !moving && this.keyAt(time)) {
      this.app.ui.setCamera(this.keys[0].camera, false);
    }
    this.show();
  }

  timeAt(event) {
    const box = this.track.getBoundingClientRect();
    return Math.round((event.clientX - box.left) / box.width * this.end);
  }

  press(event) {
    if (event.target.classList.contains('mark')) return;
    this.track.setPointerCapture(event.pointerId);
    this.go(this.timeAt(event), true);
    this.track.addEventListener('pointerup', () => this.go(this.time, false), {once: true});
  }

  drag(event) { if (this.track.hasPointerCapture(event.pointerId)) this.go(this.timeAt(event), true); }

  key(event) {
    const step = {ArrowLeft: -1, ArrowRight: 1}[event.key];
    if (step) this.go(this.time + step * (event.shiftKey ? 10 : 1), false);
    else if (event.key === 'Home') this.go(0, false);
    else if (event.key === 'End') this.go(this.end, false);
    else if (event.key === 'Delete') { event.stopPropagation(); this.remove(); }
    else return;
    event.preventDefault();
  }

  toggle() {
    if (this.isPlaying) {
      this.isPlaying = false;
      return;
    }
    const problem = animationProblem(this.keys);
    if (problem) {
      say(problem);
      return;
    }
    const last = this.keys[this.keys.length - 1].time;
    const from = this.time >= last ? this.keys[0].time : this.time, began = performance.now();
    this.isPlaying = true;
    const step = () => {
      const time = from + (performance.now() - began) / 1000 * framesPerSecond;
      if (!this.isPlaying || time >= last) {
        this.isPlaying = false;
        this.go(Math.min(time, last), false);
        return;
      }
      this.go(time, true);
      requestAnimationFrame(step);
    };
    step();
  }

  /// The film as settings of a render.
  settings() { return animationSettings(this.keys, this.app.ui.frames); }

  film() {
    const problem = animationProblem(this.keys);
    if (problem) say(problem);
    else this.app.renders.show({frames: this.app.ui.frames, settings: this.settings()});
  }
}
