// The player: buttons, keys, and the loop that draws a frame when there is a new one.
import { load } from './data.js';
import { Stage } from './stage.js';

const by = (id) => document.getElementById(id);
const SWITCHES = { markers: 'm', others: 'o', labels: 'n', ellipsoids: 'e', follow: 'f' };
const VIEWS = { 1: 'front', 2: 'side', 3: 'top', r: 'start' };

class Player {
  constructor(data, stage) {
    this.data = data;
    this.stage = stage;
    this.playing = false;
    this.at = 0;
    this.drawn = -1;
    this.last = 0;
    this.#controls();
    this.#switches();
    this.#picking();
    addEventListener('keydown', (event) => this.#key(event));
    requestAnimationFrame((now) => this.#tick(now));
  }

  get frame() {
    return Math.min(Math.floor(this.at), this.data.about.frames - 1);
  }

  play(playing) {
    this.playing = playing && this.data.about.frames > 1;
    by('play').textContent = this.playing ? '❚❚' : '▶';
  }

  go(frame) {
    this.at = Math.max(0, Math.min(frame, this.data.about.frames - 1));
  }

  #controls() {
    by('scrub').max = this.data.about.frames - 1;
    by('scrub').addEventListener('input', () => { this.play(false); this.go(Number(by('scrub').value)); });
    by('play').addEventListener('click', () => this.play(!this.playing));
    this.play(false);
    // Bands of the line, and numbers of frames in tables.
    for (const element of document.querySelectorAll('[data-frame]')) {
      element.addEventListener('click', () => {
        const { firstFrame, every } = this.data.about;
        this.play(false);
        this.go(Math.floor((Number(element.dataset.frame) - firstFrame) / every));
      });
    }
  }

  #switches() {
    const { figure } = this.stage;
    const apply = () => {
      Object.assign(figure.show, {
        markers: by('markers').checked, others: by('others').checked, ellipsoids: by('ellipsoids').checked,
      });
      figure.enlarged = Number(by('enlarged').value);
      this.stage.named = by('labels').checked;
      this.stage.follow = by('follow').checked;
      if (!this.stage.follow) this.stage.followed = null;
      this.stage.stale = true;
      this.#say();
    };
    for (const id of [...Object.keys(SWITCHES), 'enlarged']) by(id).addEventListener('change', apply);
    by('others').closest('label').hidden = this.data.about.markers.every((marker) => marker.segment);
    for (const button of document.querySelectorAll('[data-view]')) {
      button.addEventListener('click', () => this.stage.look(button.dataset.view));
    }
    apply();
  }

  #picking() {
    let down = null;
    const canvas = this.stage.renderer.domElement;
    const place = (event) => {
      const box = canvas.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    canvas.addEventListener('pointerdown', (event) => { down = place(event); });
    canvas.addEventListener('pointerup', (event) => {
      const at = place(event);
      // A drag turns the camera and picks nothing.
      if (!down || Math.hypot(at[0] - down[0], at[1] - down[1]) > 4) return;
      const found = this.stage.nearest(...at);
      if (found?.kind === 'marker') this.#say(found.index);
      else this.pick(found ? found.index : -1);
    });
    for (const element of document.querySelectorAll('[data-joint]')) {
      element.addEventListener('click', () => {
        const joint = Number(element.dataset.joint);
        this.pick(joint === this.stage.figure.picked ? -1 : joint);
      });
    }
  }

  pick(joint) {
    this.stage.figure.picked = joint;
    this.stage.stale = true;
    for (const element of document.querySelectorAll('[data-joint]')) {
      element.classList.toggle('picked', Number(element.dataset.joint) === joint);
    }
    this.#say();
  }

  /** What is picked, in words; text only, for it comes out of the file. */
  #say(marker = -1) {
    const { joints, markers, largest } = this.data.about;
    const joint = joints[this.stage.figure.picked];
    const lines = [];
    if (marker >= 0) {
      const { label, marker: name, segment } = markers[marker];
      lines.push(segment ? `${label === name ? label : `${label} = ${name}`}, marker of ${segment}` : `${label}, not assigned`);
    } else if (joint) {
      lines.push(`${joint.name}, ${joint.shown === 'none' ? 'not fitted' : `shown: ${joint.shown}`}`);
      if (joint.why) lines.push(joint.why);
      if (joint.ellipsoid) {
        const radii = [...joint.ellipsoid.radii].sort((a, b) => b - a).map((r) => (1000 * r).toPrecision(2));
        lines.push(`2 s.e. along its axes: ${radii.map(Number).join(', ')} mm`);
        const cut = Math.max(...joint.ellipsoid.radii) * this.stage.figure.enlarged > largest;
        if (this.stage.figure.show.ellipsoids && cut) lines.push(`drawn no longer than ${1000 * largest} mm`);
      }
    }
    const box = by('picked');
    box.hidden = !lines.length;
    box.replaceChildren(...lines.map((line) => Object.assign(document.createElement('p'), { textContent: line })));
  }

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { tagName, type } = event.target;
    // Keys that a control under the cursor takes for itself.
    if (tagName === 'SELECT' || (type === 'range' && event.key.startsWith('Arrow'))) return;
    if ((tagName === 'BUTTON' || tagName === 'SUMMARY' || type === 'checkbox') && event.key === ' ') return;
    const ten = event.shiftKey ? 10 : 1;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const switched = Object.keys(SWITCHES).find((id) => SWITCHES[id] === key);
    const speed = by('speed');
    const step = (frames) => { this.play(false); this.go(this.frame + frames); };
    const keys = {
      ' ': () => this.play(!this.playing),
      ArrowLeft: () => step(-ten),
      ArrowRight: () => step(ten),
      Home: () => this.go(0),
      End: () => this.go(Infinity),
      '+': () => { speed.selectedIndex = Math.min(speed.selectedIndex + 1, speed.options.length - 1); },
      '-': () => { speed.selectedIndex = Math.max(speed.selectedIndex - 1, 0); },
      Escape: () => this.pick(-1),
    };
    if (switched) by(switched).click();
    else if (VIEWS[key]) this.stage.look(VIEWS[key]);
    else if (keys[key]) keys[key]();
    else return;
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
    const said = this.data.about.bands.filter(([start, stop]) => start <= number && number < stop);
    by('where').textContent = `frame ${number} · ${this.data.time(frame).toFixed(2)} s`;
    by('done').replaceChildren(...said.map(([, , words]) => Object.assign(document.createElement('p'), { textContent: words })));
  }

  /** Milliseconds for each of so many frames, the picture finished: for tests and measurements. */
  measure(count) {
    const gl = this.stage.renderer.getContext();
    const pixel = new Uint8Array(4);
    const times = [];
    for (let i = 0; i < count; i++) {
      const start = performance.now();
      this.at = (this.frame + 1) % this.data.about.frames;
      this.draw();
      const submitted = performance.now();
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
      times.push([submitted - start, performance.now() - start]);
    }
    return times;
  }
}

async function start() {
  const message = by('message');
  let data;
  try {
    data = await load();
  } catch (error) {
    message.textContent = `The figure cannot be unpacked: it needs a browser of 2023 or later (${error.message}).`;
    return;
  }
  try {
    const player = new Player(data, new Stage(data, by('view')));
    message.textContent = '';
    window.mocapSkel = player;
    player.play(!matchMedia('(prefers-reduced-motion: reduce)').matches);
  } catch (error) {
    message.textContent = `The figure cannot be drawn: it needs WebGL (${error.message}).`;
  }
}

start();
