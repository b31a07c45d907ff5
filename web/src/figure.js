// The figure of one frame: joints, bones, markers and error ellipsoids as three.js objects.
import {
  BufferGeometry, Color, CylinderGeometry, Float32BufferAttribute, Group, IcosahedronGeometry,
  LineBasicMaterial, LineSegments, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial,
  OctahedronGeometry, Quaternion, SphereGeometry, Vector3,
} from 'three';
import { instances } from './instances.js';

// Shares of the figure's reach: a hand is drawn as fine as a whole body.
const JOINT = 0.022;
const BONE = 0.01;
const MARKER = 0.009;
const NONE = new Matrix4().makeScale(0, 0, 0);
const Y = new Vector3(0, 1, 0);
// A sign besides the colour, for those who see no difference in it.
const SHAPES = {
  yes: (size) => new IcosahedronGeometry(size, 2),
  weak: (size) => new OctahedronGeometry(1.35 * size),
  no: (size) => new IcosahedronGeometry(1.25 * size, 1),
};

export class Figure {
  constructor(data, reach) {
    const { joints, bones, markers } = data.about;
    this.data = data;
    this.group = new Group();
    this.show = { markers: true, others: false, ellipsoids: true };
    this.enlarged = 1;
    this.picked = -1;
    this.places = joints.map(() => ({ at: new Vector3(), seen: false }));
    this.markerPlaces = markers.map(() => ({ at: new Vector3(), seen: false }));
    this.colours = {};
    this.balls = Object.entries(SHAPES).map(([verdict, shape]) => {
      const mine = joints.map((joint, i) => [joint, i]).filter(([joint]) => joint.shown === verdict).map(([, i]) => i);
      const material = verdict === 'no' ? new MeshBasicMaterial({ wireframe: true }) : new MeshLambertMaterial();
      return { verdict, mine, mesh: instances(this.group, shape(JOINT * reach), material, mine.length) };
    });
    this.bones = instances(this.group, new CylinderGeometry(BONE * reach, BONE * reach, 1, 8), new MeshLambertMaterial(), bones.length);
    this.markers = instances(this.group, new IcosahedronGeometry(MARKER * reach, 1), new MeshLambertMaterial(), markers.length);
    this.ellipsoids = joints.map((joint) => joint.ellipsoid && this.#ellipsoid(joint));
    this.spokes = new LineSegments(new BufferGeometry(), new LineBasicMaterial());
    this.spokes.frustumCulled = false;
    this.ring = new Mesh(new IcosahedronGeometry(1.9 * JOINT * reach, 1), new MeshBasicMaterial({ wireframe: true, transparent: true, opacity: 0.45 }));
    this.group.add(this.spokes, this.ring);
  }

  #ellipsoid(joint) {
    const solid = new Mesh(
      new SphereGeometry(1, 24, 16),
      new MeshLambertMaterial({ transparent: true, opacity: 0.35, depthWrite: false }),
    );
    const net = new Mesh(new SphereGeometry(1, 16, 10), new MeshBasicMaterial({ wireframe: true, transparent: true, opacity: 0.45 }));
    for (const mesh of [solid, net]) mesh.matrixAutoUpdate = false;
    const [a, b, c] = joint.ellipsoid.axes.map((axis) => new Vector3(...axis));
    this.group.add(solid, net);
    return { solid, net, own: new Matrix4().makeBasis(a, b, c) };
  }

  /** Colours by their names in the style sheet, read again when the theme changes. */
  paint(colours) {
    const { joints, bones, markers } = this.data.about;
    const of = (verdict) => new Color(colours[verdict in SHAPES ? verdict : 'no']);
    this.colours = {
      marker: new Color(colours.marker), other: new Color(colours.other), leftOut: new Color(colours['left-out']),
    };
    for (const { verdict, mesh } of this.balls) mesh.material.color = of(verdict);
    bones.forEach((bone, i) => this.bones.setColorAt(i, of(bone.shown)));
    if (bones.length) this.bones.instanceColor.needsUpdate = true;
    markers.forEach((_, i) => this.markers.setColorAt(i, this.colours.marker));
    this.ellipsoids.forEach((one, i) => {
      if (one) for (const mesh of [one.solid, one.net]) mesh.material.color = of(joints[i].shown);
    });
    this.spokes.material.color = this.ring.material.color = new Color(colours.pick);
  }

  /** Moves everything to where it is in a frame. */
  pose(frame) {
    const { joints, markers } = this.data.about;
    joints.forEach((joint, i) => {
      this.places[i].seen = this.data.point(joint.point, frame, this.places[i].at);
    });
    markers.forEach((marker, i) => {
      this.markerPlaces[i].seen = this.data.point(marker.point, frame, this.markerPlaces[i].at);
    });
    for (const { mine, mesh } of this.balls) {
      mine.forEach((joint, i) => mesh.setMatrixAt(i, place(this.places[joint])));
      mesh.instanceMatrix.needsUpdate = true;
    }
    this.#bones(frame);
    this.#markers(frame);
    this.#ellipsoids(frame);
    this.#spokes();
  }

  #bones(frame) {
    this.data.about.bones.forEach((bone, i) => {
      const seen = this.data.point(bone.from, frame, from) && this.data.point(bone.to, frame, to);
      const length = to.sub(from).length();
      if (!seen || length < 1e-4) {
        this.bones.setMatrixAt(i, NONE);
        return;
      }
      turn.setFromUnitVectors(Y, to.divideScalar(length));
      from.addScaledVector(to, length / 2);
      this.bones.setMatrixAt(i, matrix.compose(from, turn, scale.set(1, length, 1)));
    });
    this.bones.instanceMatrix.needsUpdate = true;
  }

  #markers(frame) {
    const number = this.data.number(frame);
    this.data.about.markers.forEach((marker, i) => {
      const visible = marker.segment ? this.show.markers : this.show.others;
      this.markers.setMatrixAt(i, visible ? place(this.markerPlaces[i]) : NONE);
      const left = marker.leftOut.some(([start, stop]) => start <= number && number < stop);
      const colour = left ? this.colours.leftOut : marker.segment ? this.colours.marker : this.colours.other;
      this.markers.setColorAt(i, colour);
    });
    this.markers.instanceMatrix.needsUpdate = true;
    if (this.markers.instanceColor) this.markers.instanceColor.needsUpdate = true;
  }

  #ellipsoids(frame) {
    const { joints, largest } = this.data.about;
    this.ellipsoids.forEach((one, i) => {
      if (!one) return;
      const { segment, radii } = joints[i].ellipsoid;
      const seen = this.show.ellipsoids && this.places[i].seen && this.data.axes(segment, frame, from, to);
      one.solid.visible = one.net.visible = false;
      if (!seen) return;
      const sizes = radii.map((radius) => Math.min(largest, this.enlarged * radius));
      const cut = this.enlarged * Math.max(...radii) > largest;
      const mesh = cut ? one.net : one.solid;
      mesh.visible = true;
      mesh.matrix.makeBasis(from, to, scale.crossVectors(from, to)).multiply(one.own);
      mesh.matrix.scale(scale.set(...sizes.map((size) => Math.max(size, 1e-5)))).setPosition(this.places[i].at);
      mesh.matrixWorldNeedsUpdate = true;
    });
  }

  #spokes() {
    const joint = this.data.about.joints[this.picked];
    const centre = this.places[this.picked];
    this.ring.visible = Boolean(centre?.seen);
    const ends = [];
    if (this.ring.visible) {
      this.ring.position.copy(centre.at);
      this.data.about.markers.forEach((marker, i) => {
        const mine = marker.segment === joint.child && joint.spokes.includes(marker.marker);
        if (mine && this.markerPlaces[i].seen) ends.push(...centre.at.toArray(), ...this.markerPlaces[i].at.toArray());
      });
    }
    this.spokes.geometry.dispose();
    this.spokes.geometry = new BufferGeometry().setAttribute('position', new Float32BufferAttribute(ends, 3));
    this.spokes.visible = ends.length > 0;
  }
}

const from = new Vector3();
const to = new Vector3();
const scale = new Vector3();
const turn = new Quaternion();
const matrix = new Matrix4();

function place({ at, seen }) {
  return seen ? matrix.makeTranslation(at) : NONE;
}
