// Playing: the button, the slider, the views, the switches, the keys, and the loop that draws a frame when there is a new one.
import { load } from './data.js';

const VIEWS = { 1: 'front', 2: 'side', 3: 'top', r: 'start' };

const by = (id) => document.getElementById(id);

export class Playing {
  /** `switches`: the ids of check boxes, and the key of each. */
  constructor(data, stage, switches) {
    this.data = data;
    this.stage = stage;
    this.switches = switches;
    this.playing = false;
    this.at = 0;
    this.drawn = -1;
    this.last = 0;
    by('scrub').max = data.about.frames - 1;
    by('scrub').addEventListener('input', () => { this.play(false); this.go(Number(by('scrub').value)); });
    by('play').addEventListener('click', () => this.play(!this.playing));
    for (const id of Object.keys(switches)) by(id).addEventListener('change', () => this.switched());
    for (const button of document.querySelectorAll('[data-view]')) {
      button.addEventListener('click', () => this.stage.look(button.dataset.view));
    }
    this.play(false);
    addEventListener('keydown', (event) => this.#key(event));
    requestAnimationFrame((now) => this.#tick(now));
  }

  get frame() {
    return Math.min(Math.floor(this.at), this.data.about.frames - 1);
  }

  play(playing) {
    this.playing = playing && this.data.about.frames > 1;
    by('play').textContent = this.playing ? '❚❚' : '▶';
    by('play').setAttribute('aria-label', this.playing ? 'Pause' : 'Play');
  }

  go(frame) {
    this.at = Math.max(0, Math.min(frame, this.data.about.frames - 1));
  }

  /** Does what the switches say. */
  switched() {
    this.stage.follow = by('follow').checked;
    if (!this.stage.follow) this.stage.followed = null;
    this.stage.stale = true;
  }

  /** Nothing is picked any more. */
  unpick() {}

  /** What a key does on this page alone. */
  keys() {}

  /** What the page says of a frame, besides its number; returns it as text. */
  told() {
    return '';
  }

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { tagName, type } = event.target;
    // Keys that a control under the cursor takes for itself.
    if (tagName === 'SELECT' || tagName === 'TEXTAREA' || type === 'text' || type === 'search') return;
    if (type === 'range' && event.key.startsWith('Arrow')) return;
    if ((tagName === 'BUTTON' || tagName === 'SUMMARY' || type === 'checkbox') && event.key === ' ') return;
    const ten = event.shiftKey ? 10 : 1;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const speed = by('speed');
    const step = (frames) => { this.play(false); this.go(this.frame + frames); };
    const more = this.keys(key, event);
    const box = Object.keys(this.switches).find((id) => this.switches[id] === key);
    const run = {
      ' ': () => this.play(!this.playing),
      ArrowLeft: () => step(-ten),
      ArrowRight: () => step(ten),
      Home: () => this.go(0),
      End: () => this.go(Infinity),
      '+': () => { speed.selectedIndex = Math.min(speed.selectedIndex + 1, speed.options.length - 1); },
      '-': () => { speed.selectedIndex = Math.max(speed.selectedIndex - 1, 0); },
      Escape: () => this.unpick(),
      ...(VIEWS[key] && { [key]: () => this.stage.look(VIEWS[key]) }),
      ...(more && { [key]: more }),
      ...(box && { [key]: () => by(box).click() }),
    }[key];
    if (!run) return;
    run();
    event.preventDefault();
  }

  #tick(now) {
    requestAnimationFrame((next) => this.#tick(next));
    const passed = Math.min(now - this.last, 250) / 1000;
    this.last = now;
    const { frames, rate, every } = this.data.about;
    if (this.playing) this.at = (this.at + (passed * rate * Number(by('speed').value)) / every) % frames;
    if (this.frame !== this.drawn || this.stage.stale) this.draw();
  }

  draw() {
    const { frame } = this;
    this.stage.draw(frame);
    if (frame === this.drawn) return;
    this.drawn = frame;
    by('scrub').value = frame;
    const number = this.data.number(frame);
    by('where').textContent = `frame ${number} · ${this.data.time(frame).toFixed(2)} s`;
    const said = this.told(number);
    by('scrub').setAttribute('aria-valuetext', `frame ${number}${said && `, ${said}`}`);
  }
}

/** Unpacks the scene and starts the page; says so where its browser cannot. */
export async function start(make) {
  const message = by('message');
  let data;
  try {
    data = await load();
  } catch (error) {
    message.textContent = `The figure cannot be unpacked: it needs a browser of 2023 or later (${error.message}).`;
    return;
  }
  try {
    window.mocapSkel = make(data);
    message.textContent = '';
  } catch (error) {
    message.textContent = `The figure cannot be drawn: it needs WebGL (${error.message}).`;
  }
}
