import { Object3D, Quaternion, Vector3 } from "three";
import { expect, test } from "vitest";
import { Motions } from "../src/motions";

/** A frame that turns about z and moves along x evenly, told every 40 ms. */
function told(motions: Motions, frame: Object3D, until: number) {
  for (let now = 0; now <= until; now += 40) {
    motions.advance(now);
    motions.send(frame, new Vector3(now / 1000, 0, 0), new Quaternion().setFromAxisAngle(new Vector3(0, 0, 1), now / 1000), now);
  }
}

test("between messages a frame moves evenly, one message late", () => {
  const motions = new Motions(), frame = new Object3D();
  told(motions, frame, 400);
  for (const later of [0, 10, 20, 30]) {
    expect(motions.advance(400 + later)).toBe(true);
    expect(frame.position.x).toBeCloseTo(0.36 + later / 1000, 9);
    expect(2 * Math.asin(frame.quaternion.z)).toBeCloseTo(0.36 + later / 1000, 6); // three interpolates small turns linearly
  }
  expect(motions.advance(440)).toBe(false);
  expect(frame.position.x).toBeCloseTo(0.4, 9);
});

test("the first message and one after a pause are shown at once", () => {
  const motions = new Motions(), frame = new Object3D();
  motions.send(frame, new Vector3(1, 2, 3), undefined, 0);
  expect(motions.advance(0)).toBe(false);
  expect(frame.position.toArray()).toEqual([1, 2, 3]);
  motions.send(frame, new Vector3(7, 0, 0), undefined, 500);
  expect(motions.advance(500)).toBe(false);
  expect(frame.position.x).toBe(7);
});

test("pictures for films wait for nothing", () => {
  const motions = new Motions(), frame = new Object3D();
  told(motions, frame, 80);
  motions.atOnce = true;
  expect(motions.advance(81)).toBe(false);
  expect(frame.position.x).toBeCloseTo(0.08, 9);
});
