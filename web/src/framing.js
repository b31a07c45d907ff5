// Where the camera looks and from how far, so that the figure fills the view in every part of the clip.
import { Vector3 } from 'three';
import { ends } from './extent.js';

// Seconds between the poses that are looked at; at most so many of them.
const EVERY = 1 / 8;
const MOST = 600;
// Seconds before and after a frame whose poses have to fit too: the camera moves in and out no faster than that.
const AROUND = 0.6;
// A pose that needs so many times the room of the usual one is an error, and may leave the picture. By eye.
const WILD = 2.5;

export class Framing {
  constructor(data) {
    const { frames, rate, every, root } = data.about;
    const shown = rate / every;
    this.step = Math.max(1, Math.round(shown * EVERY), Math.ceil(frames / MOST));
    this.around = Math.max(1, Math.round((AROUND * shown) / this.step));
    const home = new Vector3();
    const at = new Vector3();
    this.poses = Array.from({ length: Math.ceil((frames - 1) / this.step) + 1 }, (_, k) => {
      const frame = Math.min(k * this.step, frames - 1);
      if (!data.point(root, frame, home)) return [];
      return ends(data.about).filter((end) => data.point(end, frame, at)).map((end) => data.point(end, frame, at) && at.clone().sub(home));
    });
    // The middle of all that the figure takes meanwhile.
    this.middles = ['x', 'y', 'z'].map((axis) => {
      const side = (act) => this.#meaned(this.#windows(this.poses.map((pose) => (pose.length > 1 ? act(...pose.map((one) => one[axis])) : NaN)), (some) => act(...some)));
      const [lowest, highest] = [side(Math.min), side(Math.max)];
      return lowest.map((low, k) => (low + highest[k]) / 2);
    });
    this.direction = new Vector3();
  }

  get known() {
    return this.poses.some((pose) => pose.length > 1);
  }

  /** Where the camera looks in a frame, from the root. */
  middle(frame) {
    return new Vector3(...this.middles.map((values) => this.#between(values, frame)));
  }

  /** How far from there it sees all of the figure; `tall`, `wide`: the tangents of half of what it sees. */
  distance(frame, away, up, tall, wide) {
    if (this.tall !== tall || this.wide !== wide || this.direction.distanceToSquared(away) > 1e-10) {
      this.direction.copy(away);
      [this.tall, this.wide] = [tall, wide];
      this.distances = this.#distances(away, up);
    }
    return this.#between(this.distances, frame);
  }

  #distances(away, worldUp) {
    const right = new Vector3().crossVectors(worldUp, away).normalize();
    const up = new Vector3().crossVectors(away, right);
    const point = new Vector3();
    const needed = this.poses.map((pose, k) => {
      const middle = new Vector3(...this.middles.map((values) => values[k]));
      return pose.length < 2 ? NaN : Math.max(...pose.map((one) => {
        point.subVectors(one, middle);
        return point.dot(away) + Math.max(Math.abs(point.dot(right)) / this.wide, Math.abs(point.dot(up)) / this.tall);
      }));
    });
    const sorted = needed.filter((value) => value > 0).sort((a, b) => a - b);
    const most = WILD * sorted[Math.floor(sorted.length / 2)];
    // The mean of the largest values around is smooth, and never below the value itself.
    return this.#meaned(this.#windows(needed, (values) => Math.max(...values.map((value) => Math.min(value, most)))));
  }

  #meaned(values) {
    return this.#windows(values, (some) => some.reduce((sum, value) => sum + value, 0) / some.length);
  }

  /** A value out of those known around each one; 0 where there are none. */
  #windows(values, act) {
    const filled = values.map((_, k) => {
      const some = values.slice(Math.max(0, k - this.around), k + this.around + 1).filter((value) => !Number.isNaN(value));
      return some.length ? act(some) : NaN;
    });
    const last = { value: filled.find((value) => !Number.isNaN(value)) ?? 0 };
    return filled.map((value) => (Number.isNaN(value) ? last.value : (last.value = value)));
  }

  #between(values, frame) {
    const at = frame / this.step;
    const low = Math.min(Math.floor(at), values.length - 1);
    const high = Math.min(low + 1, values.length - 1);
    return values[low] + (values[high] - values[low]) * Math.min(at - low, 1);
  }
}
