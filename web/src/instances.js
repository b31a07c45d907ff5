// Many copies of one shape, each with a place of its own.
import { DynamicDrawUsage, InstancedMesh } from 'three';

/** A mesh of `count` copies in a group. */
export function instances(group, geometry, material, count) {
  const mesh = new InstancedMesh(geometry, material, Math.max(count, 1));
  mesh.count = count;
  mesh.instanceMatrix.setUsage(DynamicDrawUsage);
  // The bounds that culling goes by are those of the first frame.
  mesh.frustumCulled = false;
  group.add(mesh);
  return mesh;
}
