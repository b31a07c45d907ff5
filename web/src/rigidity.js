// How constant the distances between markers are: what tells which of them sit on one segment.
import { Vector3 } from 'three';

// Frames that are compared; distances of fewer frames say nothing.
const FRAMES = 200;
const LEAST = 10;

export class Rigidity {
  constructor(data) {
    this.data = data;
    this.rows = new Map();
    const { frames } = data.about;
    const count = Math.min(FRAMES, frames);
    this.frames = Array.from({ length: count }, (_, k) => Math.floor((k * frames) / count));
    this.least = Math.min(LEAST, count);
  }

  /** Mean and standard deviation (metres) of a marker's distance to every marker; NaN where it is not known. */
  row(i) {
    if (!this.rows.has(i)) this.rows.set(i, this.#row(i));
    return this.rows.get(i);
  }

  #row(i) {
    const count = this.data.about.markers.length;
    const [n, sum, square] = [0, 1, 2].map(() => new Float64Array(count));
    const first = new Float64Array(count);
    const here = new Vector3();
    const there = new Vector3();
    for (const frame of this.frames) {
      if (!this.data.point(i, frame, here)) continue;
      for (let j = 0; j < count; j++) {
        if (!this.data.point(j, frame, there)) continue;
        const distance = here.distanceTo(there);
        if (!n[j]) first[j] = distance;
        // About the first one: the squares of small numbers lose no digits.
        const away = distance - first[j];
        n[j] += 1;
        sum[j] += away;
        square[j] += away * away;
      }
    }
    const known = (j) => j !== i && n[j] >= this.least;
    return {
      mean: first.map((distance, j) => (known(j) ? distance + sum[j] / n[j] : NaN)),
      spread: first.map((_, j) => (known(j) ? Math.sqrt(Math.max(square[j] / n[j] - (sum[j] / n[j]) ** 2, 0)) : NaN)),
    };
  }

  /** How far a marker's distances to these usually vary: up to half of them may sit elsewhere. NaN without any. */
  toward(i, members) {
    const { spread } = this.row(i);
    const known = members.map((j) => spread[j]).filter((value) => !Number.isNaN(value)).sort((a, b) => a - b);
    return known.length ? known[(known.length - 1) >> 1] : NaN;
  }

  /** Root mean square of how far the distances between these markers vary; NaN without any. */
  within(members) {
    return rms(members.flatMap((i, k) => members.slice(k + 1).map((j) => this.row(i).spread[j])));
  }

  /** Lines that join markers by their shortest distances: pairs of markers. */
  lines(members) {
    const joined = members.slice(0, 1);
    const rest = new Set(members.slice(1));
    const found = [];
    while (rest.size) {
      let best = [Infinity, -1, -1];
      for (const i of joined) {
        const { mean } = this.row(i);
        for (const j of rest) if (mean[j] < best[0]) best = [mean[j], i, j];
      }
      if (best[1] < 0) break;
      found.push(best.slice(1));
      joined.push(best[2]);
      rest.delete(best[2]);
    }
    return found;
  }
}

function rms(values) {
  const known = values.filter((value) => !Number.isNaN(value));
  return known.length ? Math.sqrt(known.reduce((sum, value) => sum + value * value, 0) / known.length) : NaN;
}
