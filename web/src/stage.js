// Camera, light, floor, and the words beside the joints.
import {
  Color, DirectionalLight, GridHelper, HemisphereLight, PerspectiveCamera, Scene, Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { extent } from './extent.js';
import { Framing } from './framing.js';

// The share of the view's height or width that the figure fills.
const FILLS = 0.9;
const COLOURS = ['view', 'grid', 'marker', 'other', 'pick', 'left-out'];

export class Stage {
  /** Throws where the browser has no WebGL. `Figure` is the class of what moves on it. */
  constructor(data, view, Figure) {
    this.data = data;
    this.view = view;
    this.reframe();
    this.figure = new Figure(data, this.extent.reach);
    this.renderer = new WebGLRenderer({ antialias: true });
    view.prepend(this.renderer.domElement);
    this.camera = new PerspectiveCamera(40, 1, 0.02, 200);
    this.up = new Vector3().setComponent(data.about.up, 1);
    this.camera.up.copy(this.up);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener('change', () => { this.stale = true; });
    this.scene = new Scene();
    this.sun = new DirectionalLight(0xffffff, 1.6);
    this.scene.add(new HemisphereLight(0xffffff, 0x8890a0, 1.6), this.sun, this.figure.group);
    this.follow = false;
    this.followed = null;
    this.framed = 0;
    this.stale = true;
    this.named = false;
    const names = document.getElementById('names');
    this.words = data.about.joints.map((joint) => {
      const word = document.createElement('span');
      word.textContent = joint.name;
      names.append(word);
      return word;
    });
    this.frame = 0;
    this.paint();
    const dark = matchMedia('(prefers-color-scheme: dark)');
    dark.addEventListener('change', () => this.paint());
    new ResizeObserver(() => this.#resize()).observe(view);
    this.#resize();
    this.look('start');
  }

  /** Finds anew how much room the figure takes: it is another one. */
  reframe() {
    this.extent = extent(this.data);
    this.framing = new Framing(this.data);
  }

  paint() {
    const style = getComputedStyle(document.documentElement);
    const read = (name) => style.getPropertyValue(`--${name}`).trim();
    const colours = Object.fromEntries(COLOURS.map((name) => [name, read(name)]));
    for (const verdict of ['yes', 'weak', 'no']) colours[verdict] = read(`${verdict}-ball`);
    this.scene.background = new Color(colours.view);
    if (this.grid) {
      this.scene.remove(this.grid);
      this.grid.dispose();
    }
    const { low, high } = this.extent;
    const middle = low.clone().add(high).multiplyScalar(0.5);
    const way = high.clone().sub(low).projectOnPlane(this.up).length();
    const half = Math.ceil(Math.max(1.5, way / 2 + 0.75));
    this.grid = new GridHelper(2 * half, 4 * half, colours.grid, colours.grid);
    // The grid lies square to y.
    this.grid.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), this.up);
    this.grid.position.copy(middle).projectOnPlane(this.up).addScaledVector(this.up, this.data.about.floor);
    this.scene.add(this.grid);
    this.figure.paint(colours);
    this.stale = true;
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.view;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    const looks = this.camera.position.lengthSq() > 0;
    const before = looks && this.#distance(this.frame);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    // A phone that is turned shows the figure as large as before.
    if (looks) this.#come(this.#distance(this.frame) / before);
    this.stale = true;
  }

  /** Puts the camera in front of, at the right of or above the figure of this frame, or where it was at the start. */
  look(from) {
    const front = new Vector3(...this.data.about.front);
    const right = new Vector3().crossVectors(front, this.up);
    const away = {
      front: front.clone().addScaledVector(this.up, 0.05),
      side: right.clone().addScaledVector(this.up, 0.05),
      // From a little behind, so that its front is up.
      top: this.up.clone().addScaledVector(front, -0.001),
      start: front.clone().addScaledVector(right, 0.7).addScaledVector(this.up, 0.33),
    }[from].normalize();
    const target = this.#middle();
    this.controls.target.copy(target);
    this.camera.position.copy(target).addScaledVector(away, this.#distance(this.frame, away));
    this.#keep(this.frame);
    this.controls.update();
    this.stale = true;
  }

  /** How far away the camera sees the whole figure in and around a frame. */
  #distance(frame, away = this.camera.position.clone().sub(this.controls.target).normalize()) {
    const tall = FILLS * Math.tan((this.camera.fov * Math.PI) / 360);
    const wide = tall * this.camera.aspect;
    const found = this.framing.known ? this.framing.distance(frame, away, this.up, tall, wide) : (2 * this.extent.reach) / Math.min(tall, wide);
    return Math.max(found, 3 * this.camera.near);
  }

  /** Puts the camera so many times as far from what it looks at. */
  #come(times) {
    const { position } = this.camera;
    position.sub(this.controls.target).multiplyScalar(times).add(this.controls.target);
  }

  /** The middle of the figure in a frame; where it is not seen, of its whole way. */
  #middle() {
    const at = this.#root(this.frame);
    if (at) return at.add(this.framing.middle(this.frame));
    return this.extent.low.clone().lerp(this.extent.high, 0.5);
  }

  /** Draws a frame. */
  draw(frame) {
    this.frame = frame;
    this.#keepUp(frame);
    this.figure.pose(frame);
    this.sun.position.copy(this.camera.position).addScaledVector(this.up, 2);
    this.renderer.render(this.scene, this.camera);
    this.#name();
    this.stale = false;
  }

  /** Where the root is in a frame; null where it is not seen. */
  #root(frame) {
    const at = new Vector3();
    return this.data.point(this.data.about.root, frame, at) ? at : null;
  }

  /** Remembers for which frame the camera stands right. */
  #keep(frame) {
    this.followed = this.#root(frame)?.add(this.framing.middle(frame)) ?? null;
    this.framed = frame;
  }

  /** Moves the camera with the figure, nearer where it is small; how near the user has gone stays as it is. */
  #keepUp(frame) {
    if (!this.follow || !this.#root(frame)) return;
    const was = this.followed;
    const framed = this.framed;
    this.#keep(frame);
    if (!was) return;
    const moved = this.followed.clone().sub(was);
    this.controls.target.add(moved);
    this.camera.position.add(moved);
    this.#come(this.#distance(frame) / this.#distance(framed));
    this.camera.lookAt(this.controls.target);
    this.camera.updateMatrixWorld();
  }

  /** Where a place is on the screen, in pixels of the view. */
  screen({ at, seen }) {
    if (!seen) return null;
    const p = at.clone().project(this.camera);
    if (p.z > 1) return null;
    return [((p.x + 1) / 2) * this.view.clientWidth, ((1 - p.y) / 2) * this.view.clientHeight];
  }

  #name() {
    this.words.forEach((word, i) => {
      const at = this.named || i === this.figure.picked ? this.screen(this.figure.places[i]) : null;
      word.hidden = !at;
      if (at) word.style.transform = `translate(${at[0] + 9}px, ${at[1] - 9}px)`;
    });
  }

  /** What lies nearest to a place on the screen, at most so many pixels away: { kind, index } or null. */
  nearest(x, y, within = 14) {
    let best = within;
    let found = null;
    const look = (kind, places, allowed) => places.forEach((one, index) => {
      const at = allowed(index) ? this.screen(one) : null;
      const distance = at ? Math.hypot(at[0] - x, at[1] - y) : Infinity;
      if (distance < best) [best, found] = [distance, { kind, index }];
    });
    const { markers } = this.data.about;
    const { show } = this.figure;
    look('marker', this.figure.markerPlaces, (i) => (markers[i].segment ? show.markers : show.others));
    // A joint is what most people mean where both are near.
    best = Math.max(best - 4, 10);
    look('joint', this.figure.places, () => true);
    return found;
  }
}
