// How much room the figure takes, in one frame and on its whole way.
import { Vector3 } from 'three';

const FRAMES = 60;

/** The points by which the camera finds its distance: the ends of all bones, or those that the scene names. */
export function ends({ ends: named, bones, root }) {
  return named ?? [...new Set([root, ...bones.flatMap((bone) => [bone.from, bone.to])])];
}

/** Lowest and highest corner of the whole way, and the figure's reach from its root. */
export function extent(data) {
  const { frames, root } = data.about;
  const low = new Vector3(Infinity, Infinity, Infinity);
  const high = low.clone().negate();
  const at = new Vector3();
  const home = new Vector3();
  const reaches = [];
  for (let i = 0; i < FRAMES; i++) {
    const frame = Math.floor((i / FRAMES) * frames);
    const rooted = data.point(root, frame, home);
    const lengths = [];
    for (const end of ends(data.about)) {
      if (!data.point(end, frame, at)) continue;
      low.min(at);
      high.max(at);
      if (rooted) lengths.push(at.distanceTo(home));
    }
    if (lengths.length > 1) reaches.push(Math.max(...lengths));
  }
  if (low.x > high.x) {
    low.set(-1, -1, -1);
    high.set(1, 1, 1);
  }
  return { low, high, reach: Math.max(most(reaches) ?? low.distanceTo(high) / 2, 0.02) };
}

/** What a share of the values does not exceed: one wild frame must not make the figure small in all others. */
function most(values, share = 0.9) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.floor(share * sorted.length)];
}
