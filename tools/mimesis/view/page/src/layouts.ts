// What stands where at first, by what the graph sends; what the user changes is kept under the layout's name.
import { effect, signal } from "@preact/signals";

export type Curve = { topic: string; path: string };
type Kept = { tab: string; curves: Curve[]; hidden: string[] };
export type Layout = Kept & { name: string; /** A graph that sends this has it. */ topic: string; /** Eye and what it looks at [m]; empty: all there is. */ camera: number[]; /** A topic: the camera goes along with what it draws. */ accompany?: string };

const along = (topic: string, ...paths: string[]): Curve[] => paths.map((path) => ({ topic, path }));
const AROUND = [2.4, -2.8, 1.7, 0.6, 0, 0.6];

/** The first whose topic is sent fits. */
export const LAYOUTS: Layout[] = [
  { name: "Imitation", topic: "planner/plan", tab: "Images", camera: [1.0, -2.3, 1.35, 0.95, 0.1, 0.15], hidden: ["robot_vision/seen"], // as planner/seen
    curves: along("bridge/joint_states", ...[0, 1, 2, 3, 4, 5, 6].map((j) => `position_rad[${j}]`)) },
  { name: "Drawer", topic: "sim_body/drawer", tab: "Plots", camera: AROUND, hidden: [],
    curves: [...along("walker/balance", "zmp_measured_in_world_m.y_m", "zmp_planned_in_world_m.y_m"), ...along("sim_body/drawer", "opened_m")] },
  { name: "Biped", topic: "walker/plan", tab: "Plots", camera: AROUND, hidden: [],
    curves: along("walker/balance", "zmp_measured_in_world_m.y_m", "zmp_planned_in_world_m.y_m", "com_measured_in_world_m.y_m", "com_planned_in_world_m.y_m") },
  { name: "Crowd", topic: "crowd/scene", tab: "Plots", camera: [], hidden: [],
    curves: along("crowd/certificate", "guarantees[0].disorder", "guarantees[0].measured_rate_1_s", "guarantees[0].guaranteed_rate_1_s") },
  { name: "Walk", topic: "synthesizer/figures", accompany: "synthesizer/figures", tab: "Plots", camera: AROUND, hidden: [],
    curves: along("synthesizer/motion", "velocity_forward_m_s", "phase_rate_rad_s") },
  { name: "Any", topic: "", tab: "Messages", camera: [], hidden: [], curves: [] },
];

export const fitting = (topics: Set<string>): Layout => LAYOUTS.find((l) => topics.has(l.topic) || !l.topic)!;

export const layout = signal<Layout | undefined>(undefined);
export const tab = signal("Nodes"), curves = signal<Curve[]>([]), hidden = signal<string[]>([]);

const key = (l: Layout) => `layout ${l.name}`;
function keptOf(l: Layout): Partial<Kept> {
  try {
    return JSON.parse(localStorage.getItem(key(l)) ?? "{}");
  } catch {
    return {}; // somebody else's
  }
}
export function choose(l: Layout, reset = false) {
  if (reset) localStorage.removeItem(key(l));
  const kept: Kept = { ...l, ...keptOf(l) };
  layout.value = undefined; // keeps nothing while it changes
  tab.value = kept.tab;
  curves.value = kept.curves;
  hidden.value = kept.hidden;
  layout.value = l;
}
effect(() => {
  const kept: Kept = { tab: tab.value, curves: curves.value, hidden: hidden.value };
  if (layout.value) localStorage.setItem(key(layout.value), JSON.stringify(kept));
});

/** The chosen layout as a file that others can load. */
export const saved = (): string => JSON.stringify({ layout: layout.value?.name, tab: tab.value, curves: curves.value, hidden: hidden.value }, undefined, 2) + "\n";

/** Shows what such a file holds; why not, if it is none. */
export function load(text: string): string {
  let file: any;
  try {
    file = JSON.parse(text);
  } catch {
    return "not a layout: no JSON";
  }
  const texts = (all: unknown): all is string[] => Array.isArray(all) && all.every((t) => typeof t === "string");
  const l = LAYOUTS.find((l) => l.name === file?.layout);
  const whole = typeof file?.tab === "string" && texts(file.hidden) && Array.isArray(file.curves) &&
    file.curves.every((c: any) => typeof c?.topic === "string" && typeof c?.path === "string");
  if (!l || !whole) return "not a layout: it has to hold layout, tab, curves and hidden, as Save writes them";
  choose(l);
  tab.value = file.tab;
  curves.value = file.curves.map(({ topic, path }: Curve) => ({ topic, path }));
  hidden.value = file.hidden;
  return "";
}
