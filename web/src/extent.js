// How much room the figure takes, in one frame and on its whole way.
import { Vector3 } from 'three';

const FRAMES = 60;

/** The points by which the camera finds its distance: the ends of all bones, or those that the scene names. */
export function ends({ ends: named, bones, root }) {
  return named ?? [...new Set([root, ...bones.flatMap((bone) => [bone.from, bone.to])])];
}

/** Lowest and highest corner of the whole way, and the reach of the figure about its root. */
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
    let reach = 0;
    for (const end of ends(data.about)) {
      if (!data.point(end, frame, at)) continue;
      low.min(at);
      high.max(at);
      if (rooted) reach = Math.max(reach, at.distanceTo(home));
    }
    if (reach) reaches.push(reach);
  }
  if (low.x > high.x) {
    low.set(-1, -1, -1);
    high.set(1, 1, 1);
  }
  // One wild frame must not make the figure small in all others.
  reaches.sort((a, b) => a - b);
  const reach = reaches[Math.floor(0.9 * reaches.length)] ?? low.distanceTo(high) / 2;
  return { low, high, reach: Math.max(reach, 0.02) };
}
