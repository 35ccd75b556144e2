import { Group } from "three";
import { expect, test } from "vitest";
import { Entities } from "../src/entities";
import { build } from "../src/shapes";

const none = { cubes: [], spheres: [], cylinders: [], arrows: [], lines: [], triangles: [], texts: [] };
const s = (seconds: number) => ({ seconds: BigInt(Math.floor(seconds)), nanos: Math.round((seconds % 1) * 1e9) });
const entity = (id: string, more: object = {}) => ({ ...none, id, frameId: "world", ...more });
const update = (...entities: object[]) => ({ entities, deletions: [] as object[] });
const ns = (seconds: number) => BigInt(Math.round(seconds * 1e9));
const made = () => new Entities(false, (group) => new Group().add(group));
const ids = (all: Entities) => [...all.keys()].map((k) => k.split("\n")[1]);

test("what has a lifetime ends with it, even if its topic is silent (rviz#772)", () => {
  const all = made();
  all.update("boxes", update(entity("box", { timestamp: s(1), lifetime: s(0.2) }), entity("stays", { timestamp: s(1) })), ns(1));
  all.update("arrows", update(entity("arrow")), ns(1.19));
  expect(ids(all)).toEqual(["box", "stays", "arrow"]);
  all.update("arrows", update(entity("arrow")), ns(1.21));
  expect(ids(all)).toEqual(["stays", "arrow"]);
});

test("a seek to before takes back what was not there yet, and nothing else (drcsim#7)", () => {
  const all = made();
  all.update("table", update(entity("table")), ns(0)); // without a time: that of its message
  all.update("plan", update(entity("plan", { timestamp: s(6.4) })), ns(6.4));
  all.rewind(ns(2));
  expect(ids(all)).toEqual(["table"]);
});

test("deletions are of their topic, by id or all", () => {
  const all = made();
  all.update("a", update(entity("1"), entity("2")), 0n);
  all.update("b", update(entity("1")), 0n);
  all.update("a", { entities: [], deletions: [{ id: "1", type: 0 }] }, 0n);
  expect([...all.keys()]).toEqual(["a\n2", "b\n1"]);
  all.update("b", { entities: [], deletions: [{ id: "", type: 1 }] }, 0n);
  expect([...all.keys()]).toEqual(["a\n2"]);
  all.hide(new Set(["a"]));
  expect([...all.shown()].length).toBe(0);
});

test("a cylinder has the widths of its two ends", () => {
  const pose = { position: { x: 0, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } };
  const widths = (scales: object) => {
    const group = build(entity("limb", { cylinders: [{ pose, size: { x: 1, y: 1, z: 1 }, ...scales }] }));
    const { position } = (group.children[0] as any).geometry.attributes;
    const at = (z: number) => {
      let widest = 0;
      for (let i = 0; i < position.count; ++i)
        if (Math.abs(position.getZ(i) - z) < 1e-6) widest = Math.max(widest, 2 * Math.hypot(position.getX(i), position.getY(i)));
      return +widest.toFixed(6);
    };
    return [at(-0.5), at(0.5)];
  };
  expect(widths({ bottomScale: 1, topScale: 0.5 })).toEqual([1, 0.5]);
  expect(widths({ bottomScale: 0, topScale: 1 })).toEqual([0, 1]);
  expect(widths({ bottomScale: 0, topScale: 0 })).toEqual([1, 1]); // not given
});
