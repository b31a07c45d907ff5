// What Python packed (mocap_skel/report/scene.py), unpacked.

const MISSING = -32768;
const UNIT = 1 / 32767;

/** The page's scene: `about` from JSON, positions and segment axes by frame. */
export async function load() {
  const about = JSON.parse(document.getElementById('scene').textContent);
  const packed = Uint8Array.from(atob(document.getElementById('samples').textContent.trim()), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
  const halves = new Uint8Array(await new Response(stream).arrayBuffer());
  return new Data(about, rowsOf(halves, about.frames));
}

/** Rows of 16 bits out of their differences: all low bytes, then all high ones. */
function rowsOf(halves, frames) {
  const count = halves.length / 2;
  const rows = new Int16Array(count);
  for (let i = 0; i < count; i++) {
    const before = i % frames ? rows[i - 1] : 0;
    // The array keeps 16 bits, as the differences were taken.
    rows[i] = before + (halves[i] | (halves[count + i] << 8));
  }
  return rows;
}

class Data {
  constructor(about, rows) {
    this.about = about;
    this.rows = rows;
  }

  /** Writes the place of a point in a frame into `out`; false where it is missing. */
  point(point, frame, out) {
    const { frames, middle, step } = this.about;
    const at = 3 * point * frames + frame;
    const x = this.rows[at];
    if (x === MISSING) return false;
    const [mx, my, mz] = middle[point];
    out.set(mx + step * x, my + step * this.rows[at + frames], mz + step * this.rows[at + 2 * frames]);
    return true;
  }

  /** Writes the x and the y axis of a segment in a frame; false where its pose is missing. */
  axes(segment, frame, x, y) {
    const { frames, points } = this.about;
    const at = (3 * points + 6 * segment) * frames + frame;
    if (this.rows[at] === MISSING) return false;
    const value = (i) => UNIT * this.rows[at + i * frames];
    x.set(value(0), value(1), value(2)).normalize();
    y.set(value(3), value(4), value(5)).addScaledVector(x, -x.dot(y)).normalize();
    return true;
  }

  /** The clip's own number of a shown frame. */
  number(frame) {
    return this.about.firstFrame + frame * this.about.every;
  }

  /** Seconds as the clip's file counts them; a clip cut out of a longer take keeps its place in it. */
  time(frame) {
    return (this.number(frame) - this.about.zeroFrame) / this.about.rate;
  }
}
