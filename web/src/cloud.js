// The markers of one frame in the colours of their segments: balls, lines within a segment, trails of what is selected.
import {
  BackSide, BufferGeometry, Color, Float32BufferAttribute, Group, IcosahedronGeometry, LineBasicMaterial, LineSegments,
  Matrix4, MeshBasicMaterial, MeshLambertMaterial, Quaternion, Vector3,
} from 'three';
import { instances } from './instances.js';

// Share of the figure's reach.
const MARKER = 0.013;
const LARGER = 1.5;
const RIM = 2.1;
// Seconds of a trail before and after the frame, and how many markers get one.
const TRAIL = 1.5;
const MOST_TRAILS = 6;
const NONE = new Matrix4().makeScale(0, 0, 0);
const GOLDEN = 137.508;

/** The colour of a segment, as far as possible from those of the segments before it. */
export function colourOf(segment) {
  const dark = matchMedia('(prefers-color-scheme: dark)').matches;
  const light = (dark ? 66 : 46) + [0, 10, -8][segment % 3];
  return `hsl(${((segment * GOLDEN + 210) % 360).toFixed(0)}, ${dark ? 75 : 70}%, ${light}%)`;
}

export class Cloud {
  constructor(data, reach) {
    const count = data.about.markers.length;
    this.data = data;
    this.group = new Group();
    this.show = { markers: true, others: true, lines: true };
    this.picked = -1;
    this.places = [];
    this.markerPlaces = Array.from({ length: count }, () => ({ at: new Vector3(), seen: false }));
    this.shown = () => true;
    this.selected = new Set();
    this.segments = new Array(count).fill(-1);
    this.ignored = new Array(count).fill(false);
    this.pairs = [];
    this.colours = {};
    this.balls = instances(this.group, new IcosahedronGeometry(MARKER * reach, 2), new MeshLambertMaterial(), count);
    // Only the far side of a larger ball: the rim around a marker.
    this.rims = instances(this.group, new IcosahedronGeometry(RIM * MARKER * reach, 2), new MeshBasicMaterial({ side: BackSide }), count);
    this.lines = this.#lines();
    this.trails = this.#lines();
  }

  #lines() {
    const lines = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ vertexColors: true }));
    lines.frustumCulled = false;
    this.group.add(lines);
    return lines;
  }

  /** Colours by their names in the style sheet, read again when the theme changes. */
  paint(colours) {
    this.colours = { other: new Color(colours.other), pick: new Color(colours.pick), view: new Color(colours.view) };
    this.segmentColours = this.data.about.segments.map((_, i) => new Color(colourOf(i)));
    this.rims.material.color = this.colours.pick;
  }

  #colour(i) {
    return this.segmentColours[this.segments[i]] ?? this.colours.other;
  }

  /** Moves everything to where it is in a frame. */
  pose(frame) {
    this.markerPlaces.forEach((place, i) => {
      place.seen = this.shown(i) && this.data.point(i, frame, place.at);
      const size = this.selected.has(i) ? LARGER : this.ignored[i] ? 0.5 : 1;
      this.balls.setMatrixAt(i, place.seen ? matrix.compose(place.at, still, scale.setScalar(size)) : NONE);
      this.balls.setColorAt(i, this.#colour(i));
      this.rims.setMatrixAt(i, place.seen && this.selected.has(i) ? matrix.makeTranslation(place.at) : NONE);
    });
    for (const mesh of [this.balls, this.rims]) mesh.instanceMatrix.needsUpdate = true;
    if (this.balls.instanceColor) this.balls.instanceColor.needsUpdate = true;
    this.#sticks();
    this.#trails(frame);
  }

  #sticks() {
    const ends = [];
    const colours = [];
    for (const [i, j] of this.show.lines ? this.pairs : []) {
      const [a, b] = [this.markerPlaces[i], this.markerPlaces[j]];
      if (!a.seen || !b.seen) continue;
      ends.push(...a.at.toArray(), ...b.at.toArray());
      const colour = this.#colour(i).toArray();
      colours.push(...colour, ...colour);
    }
    draw(this.lines, ends, colours);
  }

  #trails(frame) {
    const { rate, every, frames } = this.data.about;
    const around = Math.ceil((TRAIL * rate) / every);
    const ends = [];
    const colours = [];
    const shade = new Color();
    for (const i of [...this.selected].slice(0, MOST_TRAILS)) {
      for (let k = Math.max(0, frame - around); k < Math.min(frames - 1, frame + around); k++) {
        if (!this.data.point(i, k, from) || !this.data.point(i, k + 1, to)) continue;
        ends.push(...from.toArray(), ...to.toArray());
        // It fades into the ground with the time from now.
        shade.copy(this.#colour(i)).lerp(this.colours.view, Math.abs(k - frame) / (around + 1));
        colours.push(...shade.toArray(), ...shade.toArray());
      }
    }
    draw(this.trails, ends, colours);
  }
}

function draw(lines, ends, colours) {
  lines.geometry.dispose();
  lines.geometry = new BufferGeometry()
    .setAttribute('position', new Float32BufferAttribute(ends, 3))
    .setAttribute('color', new Float32BufferAttribute(colours, 3));
  lines.visible = ends.length > 0;
}

const from = new Vector3();
const to = new Vector3();
const scale = new Vector3();
const still = new Quaternion();
const matrix = new Matrix4();
