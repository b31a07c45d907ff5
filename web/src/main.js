// The report page: the player with its switches, and what is picked in it.
import { Figure } from './figure.js';
import { Playing, start } from './playing.js';
import { Stage } from './stage.js';

const by = (id) => document.getElementById(id);
// Pixels from a band at which a finger still means it.
const FINGER = 24;
const SWITCHES = { markers: 'm', others: 'o', labels: 'n', ellipsoids: 'e', follow: 'f' };

class Player extends Playing {
  constructor(data, stage) {
    super(data, stage, SWITCHES);
    by('enlarged').addEventListener('change', () => this.switched());
    by('others').closest('label').hidden = data.about.markers.every((marker) => marker.segment);
    this.switched();
    this.#picking();
    this.#bands();
    this.#angles();
    // Bands of the line, and numbers of frames in tables.
    for (const element of document.querySelectorAll('[data-frame]')) {
      element.addEventListener('click', () => {
        this.goTo(Number(element.dataset.frame));
        if (element.closest('main section:not(#stage)')) by('view').scrollIntoView({ block: 'nearest' });
      });
    }
  }

  #bands() {
    for (const button of document.querySelectorAll('[data-kind]')) {
      button.addEventListener('click', () => this.band(button.dataset.kind));
    }
    by('bands')?.addEventListener('click', (event) => {
      // A finger is wider than a short band: the nearest one is meant.
      const away = (rect) => {
        const { left, right, top, bottom } = rect.getBoundingClientRect();
        const [x, y] = [event.clientX, event.clientY];
        return Math.hypot(Math.max(left - x, 0, x - right), Math.max(top - y, 0, y - bottom));
      };
      const near = [...by('bands').querySelectorAll('rect')].map((rect) => [away(rect), rect]).sort(([a], [b]) => a - b)[0];
      if (event.target === by('bands') && near && near[0] <= FINGER) this.goTo(Number(near[1].dataset.frame));
    });
  }

  /** The pictures of joint angles: the chosen joint's is shown, and a place in it is a frame. */
  #angles() {
    const [choice, plots] = [by('angle-joint'), by('angle-plots')];
    if (!plots) return;
    choice.addEventListener('change', () => {
      for (const one of plots.children) one.hidden = one.dataset.angles !== choice.value;
    });
    plots.addEventListener('click', (event) => {
      const svg = event.target.closest('svg');
      if (!svg) return;
      const { first, last, left, wide } = Object.fromEntries(Object.entries(plots.dataset).map(([name, value]) => [name, Number(value)]));
      const box = svg.getBoundingClientRect();
      const share = (((event.clientX - box.left) / box.width) * wide - left) / (wide - left);
      this.goTo(Math.round(first + Math.min(Math.max(share, 0), 1) * (last - first)));
    });
  }

  /** Puts the strong line of every picture of angles at a frame. */
  #now(number) {
    const plots = by('angle-plots');
    if (!plots) return;
    const { first, last, left, wide } = plots.dataset;
    const x = ((number - first) / (last - first)) * (wide - left);
    this.lines ??= [...plots.querySelectorAll('.now')];
    for (const line of this.lines) line.setAttribute('transform', `translate(${x.toFixed(1)})`);
  }

  /** Stands still in the frame of this number in the file. */
  goTo(number) {
    const { firstFrame, every } = this.data.about;
    this.play(false);
    this.go(Math.ceil((number - firstFrame) / every));
  }

  /** Goes to the start of the next band, of a kind or of any; after the last one to the first. */
  band(kind = '', back = false) {
    const { firstFrame, every, bands } = this.data.about;
    const starts = bands.filter(([, , words]) => words.startsWith(kind)).map(([start]) => Math.ceil((start - firstFrame) / every));
    const sorted = [...new Set(starts)].sort((a, b) => (back ? b - a : a - b));
    if (!sorted.length) return;
    this.play(false);
    this.go(sorted.find((start) => (back ? start < this.frame : start > this.frame)) ?? sorted[0]);
  }

  keys(key, event) {
    return key === 'b' ? () => this.band('', event.shiftKey) : null;
  }

  switched() {
    const { figure } = this.stage;
    Object.assign(figure.show, {
      markers: by('markers').checked, others: by('others').checked, ellipsoids: by('ellipsoids').checked,
    });
    figure.enlarged = Number(by('enlarged').value);
    this.stage.named = by('labels').checked;
    super.switched();
    this.#say();
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

  unpick() {
    this.pick(-1);
  }

  told(number) {
    this.#now(number);
    const said = this.data.about.bands.filter(([start, stop]) => start < number + this.data.about.every && number < stop);
    by('done').replaceChildren(...said.map(([, , words]) => Object.assign(document.createElement('p'), { textContent: words })));
    return said.map(([, , words]) => words).join(', ');
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

/** How much stands above the view, for the style sheet: the view takes the rest of the window. */
function fit() {
  const above = by('stage').getBoundingClientRect().top + scrollY;
  document.documentElement.style.setProperty('--above', `${Math.round(above)}px`);
}

export const report = () => start((data) => {
  fit();
  addEventListener('resize', fit);
  const player = new Player(data, new Stage(data, by('view'), Figure));
  player.play(!matchMedia('(prefers-reduced-motion: reduce)').matches);
  return player;
});
