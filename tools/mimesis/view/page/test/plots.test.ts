import { expect, test, vi } from "vitest";

vi.stubGlobal("localStorage", { getItem: () => null, setItem: () => {}, removeItem: () => {} });
vi.stubGlobal("matchMedia", () => ({ matches: false, addEventListener: () => {} })); // uPlot asks at once
vi.mock("uplot", () => ({ default: class {} }));
const { within } = await import("../src/plots");

test("the range is that of what is seen: points beside the window count where the line enters it (rerun#10064)", () => {
  const t = [0, 10, 20], y = [0, 100, 0];
  expect(within(t, y, 4, 6).sort((a, b) => a - b)).toEqual([40, 60]); // between two rare points
  expect(Math.max(...within(t, y, 5, 15))).toBe(100);
  expect(within(t, y, 30, 40)).toEqual([]);
});
