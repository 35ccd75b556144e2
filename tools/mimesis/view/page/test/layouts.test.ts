import { beforeAll, expect, test } from "vitest";

const kept = new Map<string, string>();
let layouts: typeof import("../src/layouts");
beforeAll(async () => {
  Object.assign(globalThis, {
    localStorage: { getItem: (k: string) => kept.get(k) ?? null, setItem: (k: string, v: string) => kept.set(k, v), removeItem: (k: string) => kept.delete(k) },
  });
  layouts = await import("../src/layouts");
});

test("the layout fits what the graph sends", () => {
  for (const l of layouts.LAYOUTS.filter((l) => l.topic)) expect(layouts.fitting(new Set(["n/log", l.topic])).name).toBe(l.name);
  expect(layouts.fitting(new Set(["walker/plan", "sim_body/drawer"])).name).toBe("Drawer"); // not the biped alone
  expect(layouts.fitting(new Set(["n/log"])).name).toBe("Any");
});

test("what the user changes stays with its layout alone, until it is reset", () => {
  const [arm, , biped] = layouts.LAYOUTS;
  layouts.choose(arm!);
  layouts.hidden.value = ["planner/seen"];
  layouts.tab.value = "Log";
  layouts.choose(biped!);
  expect(layouts.hidden.value).toEqual([]);
  expect(layouts.tab.value).toBe(biped!.tab);
  layouts.choose(arm!);
  expect(layouts.hidden.value).toEqual(["planner/seen"]);
  expect(layouts.tab.value).toBe("Log");
  layouts.choose(arm!, true);
  expect(layouts.hidden.value).toEqual(arm!.hidden);
  expect(layouts.tab.value).toBe("Images");
});

test("what others kept under the name does no harm", () => {
  kept.set("layout Crowd", "{nonsense");
  layouts.choose(layouts.LAYOUTS.find((l) => l.name === "Crowd")!);
  expect(layouts.tab.value).toBe("Plots");
});

test("a saved layout is loaded elsewhere, and nothing else is", () => {
  const [arm, , biped] = layouts.LAYOUTS;
  layouts.choose(biped!);
  layouts.curves.value = [{ topic: "walker/balance", path: "header.seq" }];
  layouts.tab.value = "Why";
  const file = layouts.saved();
  layouts.choose(biped!, true);
  layouts.choose(arm!);
  expect(layouts.load(file)).toBe("");
  expect(layouts.layout.value).toBe(biped);
  expect(layouts.tab.value).toBe("Why");
  expect(layouts.curves.value).toEqual([{ topic: "walker/balance", path: "header.seq" }]);
  for (const wrong of ["", "[]", "null", '{"layout":"Biped"}', '{"layout":"Biped","tab":"Why","hidden":[1],"curves":[]}', '{"layout":"Biped","tab":"Why","hidden":[],"curves":[{}]}'])
    expect(layouts.load(wrong), wrong).toMatch(/^not a layout: /);
  expect(layouts.tab.value).toBe("Why");
});
