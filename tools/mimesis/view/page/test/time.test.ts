import { expect, test } from "vitest";
import { eventAt, nextEvent } from "../src/time";

const all = [1, 2, 2, 5].map((positionS) => ({ positionS }));

test("the last event at or before a time", () => {
  expect([0.5, 1, 1.5, 2, 4.9, 9].map((s) => eventAt(all, s))).toEqual([-1, 0, 0, 2, 2, 3]);
  expect(eventAt([], 1)).toBe(-1);
});

test("jumps go on, also from an event and through some of one moment", () => {
  expect([0, 1, 2, 3].map((s) => nextEvent(all, s, 1))).toEqual([1, 2, 5, 5]);
  expect(nextEvent(all, 5, 1)).toBeUndefined();
  expect([6, 5, 2, 1.5].map((s) => nextEvent(all, s, -1))).toEqual([5, 2, 1, 1]);
  expect(nextEvent(all, 1, -1)).toBeUndefined();
});
