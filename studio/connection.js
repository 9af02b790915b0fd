// The WebSocket to the server: requests with replies, frames, and coming back after a loss.

import {parseFrame} from './framing.js';

const firstDelay = 300, longestDelay = 4000;  // milliseconds between attempts

/// Events: `open` (each time), `lost` (detail: whether the key is no longer valid), `frame` and
/// `draft` (detail: parseFrame()), `message` (detail: a message without a waiting request).
export class Connection extends EventTarget {
  constructor() {
    super();
    this.next = 1;
    this.waiting = new Map();
    this.delay = firstDelay;
    this.isOpen = false;
  }

  connect() {
    const socket = new WebSocket(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/ws`);
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => {
      this.isOpen = true;
      this.delay = firstDelay;
      this.dispatchEvent(new Event('open'));
    };
    socket.onmessage = (event) => this.receive(event.data);
    socket.onclose = () => this.lose();
    this.socket = socket;
  }

  async lose() {
    this.isOpen = false;
    const waiting = [...this.waiting.values()];
    this.waiting.clear();
    for (const {reject} of waiting) reject(new Error('the connection was lost'));
    const answer = await fetch('/', {cache: 'no-store'}).catch(() => null);
    const invalid = answer !== null && (answer.status === 401 || answer.status === 403);
    this.dispatchEvent(new CustomEvent('lost', {detail: invalid}));
    setTimeout(() => this.connect(), this.delay);
    this.delay = Math.min(this.delay * 1.6, longestDelay);
  }

  /// Sends a message without waiting for its reply; returns its id, or 0 without a connection.
  send(op, fields = {}) {
    if (!this.isOpen) return 0;
    const id = this.next++;
    this.socket.send(JSON.stringify({op, id, ...fields}));
    return id;
  }

  /// The reply to a message, a promise with the message's `id`. `onprogress` gets messages on
  /// progress before it.
  request(op, fields = {}, onprogress = null) {
    const id = this.send(op, fields);
    const reply = new Promise((resolve, reject) => {
      if (id === 0) reject(new Error('there is no connection'));
      else this.waiting.set(id, {resolve, reject, onprogress});
    });
    return Object.assign(reply, {id});
  }

  receive(data) {
    if (typeof data !== 'string') {
      const frame = parseFrame(data);
      this.dispatchEvent(new CustomEvent(frame.packed ? 'draft' : 'frame', {detail: frame}));
      return;
    }
    const message = JSON.parse(data);
    const waiting = this.waiting.get(message.id);
    if (!waiting) {
      this.dispatchEvent(new CustomEvent('message', {detail: message}));
    } else if (message.op === 'progress' || message.op === 'log') {
      waiting.onprogress?.(message);
    } else {
      this.waiting.delete(message.id);
      if (message.op === 'error') waiting.reject(new Error(message.message));
      else waiting.resolve(message);
    }
  }
}
