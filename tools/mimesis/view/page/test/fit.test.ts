import { Box3, PerspectiveCamera, Sprite, Vector3 } from "three";
import { expect, test } from "vitest";
import { ease, filled, fit } from "../src/fit";
import { arrange } from "../src/labels";
import { rows } from "../src/shapes";

function camera(from: Vector3, target: Vector3, aspect: number) {
  const made = new PerspectiveCamera(45, aspect, 0.02, 500);
  made.up.set(0, 0, 1);
  made.position.copy(from);
  made.lookAt(target);
  return made;
}

test("whatever the robot or crowd, from wherever: all of it is in the picture, and fills it", () => {
  const boxes = {
    arm: new Box3(new Vector3(-0.3, -0.8, 0), new Vector3(0.9, 0.7, 1.4)),
    crowd: new Box3(new Vector3(-30, -12, 0), new Vector3(25, 40, 0.1)),
    gripper: new Box3(new Vector3(1, 1, 0.2), new Vector3(1.05, 1.08, 0.3)),
  };
  for (const [name, box] of Object.entries(boxes))
    for (const from of [new Vector3(2, -3, 1.5), new Vector3(-1, 0.2, 0.3), new Vector3(0, -0.1, 9)])
      for (const aspect of [0.5, 1.15, 2.4]) {
        const target = new Vector3(0.4, 0, 0.4), eye = camera(from, target, aspect);
        const pose = fit(eye, target, box);
        const seen = filled(camera(pose.eye, pose.target, aspect), box);
        expect(seen, `${name} from ${from.toArray()} ${aspect}`).toBeLessThan(1);
        if (name !== "gripper") expect(seen).toBeGreaterThan(0.9);
        expect(pose.eye.clone().sub(pose.target).normalize().distanceTo(from.clone().sub(target).normalize())).toBeLessThan(1e-6); // the same direction
      }
});

test("what is cut off or behind the camera is told", () => {
  const eye = camera(new Vector3(0, -3, 0), new Vector3(), 1);
  expect(filled(eye, new Box3(new Vector3(-0.1, -0.1, -0.1), new Vector3(0.1, 0.1, 0.1)))).toBeLessThan(0.1);
  expect(filled(eye, new Box3(new Vector3(-0.1, -0.1, -0.1), new Vector3(4, 0.1, 0.1)))).toBeGreaterThan(1);
  expect(filled(eye, new Box3(new Vector3(-0.1, -9, -0.1), new Vector3(0.1, 0, 0.1)))).toBe(Infinity);
});

test("the camera goes there without a jump, and arrives", () => {
  const eye = new Vector3(0, 0, 0), target = new Vector3(0, 1, 0), to = { eye: new Vector3(10, 0, 0), target: new Vector3(10, 1, 0) };
  let moves = 0, most = 0, last = 0;
  for (; ease(eye, target, to, 1 / 60) && moves < 1000; ++moves) (most = Math.max(most, eye.x - last)), (last = eye.x);
  expect(most).toBeLessThan(1);
  expect(moves).toBeLessThan(300);
  expect(eye.x).toBeCloseTo(10, 1);
});

test("texts do not overprint, keep a size that can be read, and are left out where there are too many", () => {
  const eye = camera(new Vector3(0, -5, 0), new Vector3(), 1);
  eye.updateMatrixWorld();
  const text = (x: number, z: number) => {
    const sprite = new Sprite();
    sprite.userData = { metres: 0.02, aspect: 6 }; // 2 px from there
    sprite.position.set(x, 0, z);
    sprite.updateMatrixWorld();
    return sprite;
  };
  const texts = [text(0, 0), text(0.01, 0.01), text(1.5, 0)];
  arrange(texts, eye, 400, 400);
  const perMetre = 400 / (2 * Math.tan(Math.PI / 8)) / 5;
  for (const t of texts) expect(t.scale.y * perMetre).toBeCloseTo(11, 3);
  expect(texts[2]!.center.y).toBeCloseTo(0.5, 6); // nobody is near it
  expect(Math.abs(texts[0]!.center.y - texts[1]!.center.y)).toBeGreaterThan(0.9); // one above the other
  const many = Array.from({ length: 40 }, () => text(0, 0));
  arrange(many, eye, 400, 400);
  expect(many.filter((t) => t.visible).length).toBeGreaterThan(3);
  expect(many.filter((t) => t.visible).length).toBeLessThan(12);
});

test("a row of balls that meet is a rod, others stay balls", () => {
  const balls = (n: number, step: number, x = 0) => Array.from({ length: n }, (_, i) => ({
    pose: { position: { x, y: 0, z: i * step } }, size: { x: 0.04, y: 0.04, z: 0.04 }, color: { r: 0, g: 0, b: 1, a: 1 } }));
  const post = balls(12, 0.03), beam = balls(8, 0.03, 0.5), apart = balls(9, 0.05, 1);
  const found = rows([...post, ...beam, ...apart]);
  expect(found.rods).toEqual([{ from: post[0], to: post[11] }, { from: beam[0], to: beam[7] }]);
  expect(found.rest).toEqual(apart);
  const bent = balls(6, 0.03);
  bent[3]!.pose.position.x = 0.02;
  expect(rows(bent).rods).toEqual([]);
  const other = balls(6, 0.03);
  other[3]!.color = { r: 1, g: 0, b: 0, a: 1 };
  expect(rows(other).rods).toEqual([]);
});
