// A camera that shows all there is: where it has to stand, and how it gets there.
import { Box3, PerspectiveCamera, Vector3 } from "three";

export type Pose = { eye: Vector3; target: Vector3 };
const ROOM = 1.06; // free space around
const NEAREST = 0.3; // [m]

function corners(box: Box3): Vector3[] {
  const { min, max } = box;
  return [0, 1, 2, 3, 4, 5, 6, 7].map((i) => new Vector3(i & 1 ? max.x : min.x, i & 2 ? max.y : min.y, i & 4 ? max.z : min.z));
}

/** From the direction in which it looks now, the nearest place from which the whole box is in the picture, and that in the middle. */
export function fit(camera: PerspectiveCamera, target: Vector3, box: Box3): Pose {
  const back = camera.position.clone().sub(target).normalize();
  const right = new Vector3().crossVectors(camera.up, back).normalize(), up = new Vector3().crossVectors(back, right);
  const tall = Math.tan((camera.fov * Math.PI) / 360) / ROOM, wide = tall * camera.aspect;
  const points = corners(box).map((c) => [c.dot(right), c.dot(up), c.dot(back)] as const);
  // The eye is behind each of four planes that pass through a corner; the two of a pair tell where its middle is.
  const most = (axis: 0 | 1, slope: number, sign: 1 | -1) => Math.max(...points.map((p) => sign * p[axis] + slope * p[2]));
  const place = (axis: 0 | 1, slope: number) => {
    const high = most(axis, slope, 1), low = most(axis, slope, -1);
    return { at: (high - low) / 2, back: (high + low) / 2 / slope };
  };
  const x = place(0, wide), y = place(1, tall), middle = box.getCenter(new Vector3()).dot(back);
  const distance = Math.max(x.back, y.back, middle + NEAREST);
  const eye = right.clone().multiplyScalar(x.at).addScaledVector(up, y.at).addScaledVector(back, distance);
  return { eye, target: eye.clone().addScaledVector(back, middle - distance) };
}

/** The part of the picture that the box fills, along its longer side; above 1: it is cut off. */
export function filled(camera: PerspectiveCamera, box: Box3): number {
  camera.updateMatrixWorld();
  let most = 0;
  for (const c of corners(box)) {
    const deep = c.clone().applyMatrix4(camera.matrixWorldInverse).z;
    if (deep > -camera.near) return Infinity;
    c.project(camera);
    most = Math.max(most, Math.abs(c.x), Math.abs(c.y));
  }
  return most;
}

const CALM_S = 0.35; // time in which it has gone most of the way

/** Goes towards a pose, evenly in time; whether it is still on its way. */
export function ease(eye: Vector3, target: Vector3, to: Pose, s: number): boolean {
  const share = 1 - Math.exp(-s / CALM_S);
  eye.lerp(to.eye, share);
  target.lerp(to.target, share);
  return eye.distanceTo(to.eye) > 1e-3 * (eye.distanceTo(target) + 1e-3);
}
