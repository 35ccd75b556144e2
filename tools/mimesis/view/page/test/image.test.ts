import { expect, test } from "vitest";
import { free } from "../src/image";

test("captions do not overprint, and stay in the picture", () => {
  const taken: Parameters<typeof free>[0] = [];
  const box = { x: 8, y: 8, w: 100, h: 20 };
  const ys = [0, 1, 2].map(() => free(taken, { ...box }));
  expect(ys).toEqual([8, 28, 48]); // above the first there is no room
  expect(free(taken, { ...box, x: 300 })).toBe(8); // beside them there is
  expect(free(taken, { ...box, y: 58 })).toBe(68); // nearest
});
