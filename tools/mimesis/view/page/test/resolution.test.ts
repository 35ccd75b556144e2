import { expect, test } from "vitest";
import { RATIOS, Resolution } from "../src/resolution";

/** Draws for `seconds` on a machine that needs `perPixel` ms for a picture of ratio 1 and `other` for the rest; 60 a second are shown. */
function run(resolution: Resolution, perPixel: number, seconds: number, begin = 0, other = 0): { now: number; changes: number } {
  let now = begin, changes = 0;
  while (now < begin + 1000 * seconds) {
    const took = Math.max(1000 / 60, other + perPixel * resolution.ratio ** 2);
    now += took;
    if (resolution.drawn(took, now)) ++changes;
  }
  return { now, changes };
}

test("a fast machine draws at the finest, a slow one as finely as it can", () => {
  for (const [perPixel, ratio] of [[1, 2], [8, 1.4], [15, 1], [30, 0.7], [60, 0.5], [500, 0.5]] as const) {
    const resolution = new Resolution();
    run(resolution, perPixel, 29);
    expect(resolution.ratio, `${perPixel} ms`).toBe(ratio);
  }
});

test("it does not waver, and tries again what was too slow", () => {
  const resolution = new Resolution();
  const first = run(resolution, 15, 29);
  expect(first.changes).toBeLessThanOrEqual(2); // tries finer once
  run(resolution, 1, 60, first.now);
  expect(resolution.ratio).toBe(RATIOS[0]);
});

test("a slow begin, while the page loads, is forgotten", () => {
  const resolution = new Resolution();
  const { now } = run(resolution, 1, 2, 0, 200);
  run(resolution, 30, 40, now);
  expect(resolution.ratio).toBe(0.7);
});

test("what does not depend on the pixels does not cost any", () => {
  const resolution = new Resolution();
  const { changes } = run(resolution, 1, 29, 0, 40);
  expect(resolution.ratio).toBe(1);
  expect(changes).toBeLessThanOrEqual(8); // tries after 3, 6, 12 s
});
