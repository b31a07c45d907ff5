// How much room the figure takes, in one frame and on its whole way.
import { Vector3 } from 'three';

const FRAMES = 60;

/** The points by which the camera finds its distance: the ends of all bones, or those that the scene names. */
export function ends({ ends: named, bones, root }) {
  return named ?? [...new Set([root, ...bones.flatMap((bone) => [bone.from, bone.to])])];
}

/**
 * Lowest and highest corner of the whole way; and about the root, the middle of the figure's box, its reach, and the
 * places that its points take in each of some frames.
 */
export function extent(data) {
  const { frames, root } = data.about;
  const low = new Vector3(Infinity, Infinity, Infinity);
  const high = low.clone().negate();
  const at = new Vector3();
  const home = new Vector3();
  const poses = [];
  for (let i = 0; i < FRAMES; i++) {
    const frame = Math.floor((i / FRAMES) * frames);
    const rooted = data.point(root, frame, home);
    const pose = [];
    for (const end of ends(data.about)) {
      if (!data.point(end, frame, at)) continue;
      low.min(at);
      high.max(at);
      if (rooted) pose.push(at.clone().sub(home));
    }
    if (pose.length > 1) poses.push(pose);
  }
  if (low.x > high.x) {
    low.set(-1, -1, -1);
    high.set(1, 1, 1);
  }
  const reaches = poses.map((pose) => Math.max(...pose.map((point) => point.length())));
  const reach = most(reaches) ?? low.distanceTo(high) / 2;
  const middle = new Vector3();
  for (const axis of poses.length ? ['x', 'y', 'z'] : []) {
    const own = poses.map((pose) => pose.map((point) => point[axis]));
    const highest = most(own.map((values) => Math.max(...values)));
    const lowest = -most(own.map((values) => -Math.min(...values)));
    middle[axis] = (lowest + highest) / 2;
  }
  return { low, high, middle, poses, reach: Math.max(reach, 0.02) };
}

/** What a share of the values does not exceed: one wild frame must not make the figure small in all others. */
export function most(values, share = 0.9) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.floor(share * sorted.length)];
}
