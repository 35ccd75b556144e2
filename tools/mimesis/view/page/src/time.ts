// Seconds of the run: a log's count from its first message, a running graph's from its nodes' start.
import { computed, signal } from "@preact/signals";
import type { Connection } from "./connection";
import { starts } from "./wiring";

/** State of the player of a log (v1.PlayerStatus); undefined: the graph runs. */
export const status = signal<any>(undefined);

const beginNs = (s: any) => Number(s.logTimeNs) - 1e9 * s.positionS;
/** Time from which a run's seconds count [ns]. */
export const originNs = computed(() => {
  if (status.value) return beginNs(status.value);
  const walls = [...starts.value.values()].filter((s) => s.clock === "wall").map((s) => Number(s.header.stampNs));
  return walls.length && walls.length === starts.value.size ? Math.min(...walls) : 0; // simulated time begins at 0
});
export const runS = (ns: bigint) => (Number(ns) - originNs.value) / 1e9;
const YEAR_2000_NS = 9.466848e17;
/** Whether the run's time is that of the wall. */
export const hasWallTime = computed(() => originNs.value > YEAR_2000_NS);

const STATUS = "mimesis.v1.PlayerStatus";
export const playerOf = (connection: Connection): string | undefined =>
  [...connection.services.value.values()].find((s) => s.response.schemaName === STATUS && s.name.endsWith("/status"))?.name.slice(0, -7);

/** Asks the player; its answer is the new status. */
export async function ask(connection: Connection, what: string, request: object = {}) {
  const name = playerOf(connection);
  if (name) status.value = await connection.call(`${name}/${what}`, request).catch(() => status.value);
}
const BEHIND_S = 1e-6; // so that what happens at that time has happened
export const seek = (connection: Connection, s: number) =>
  ask(connection, "seek", { target: { case: "positionS", value: Math.min(s + BEHIND_S, status.value?.endS ?? Infinity) } });

/** What happened, as the player tells it (v1.PlayerMark): in the order of time. */
export const marks = signal<any[]>([]);
export const KINDS = ["", "log", "seen", "decision", "plan", "motion", "stop", "parameter"];
/** Marks that tell the run: all but the lines of logs that warn of nothing. */
export const events = computed(() => marks.value.filter((m) => m.kind > 1 || m.level > 2));

const NEAR_S = 1e-3;
/** The last event at or before a time; -1: none. */
export function eventAt(all: { positionS: number }[], s: number): number {
  let low = 0, high = all.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    all[middle]!.positionS <= s + NEAR_S ? (low = middle + 1) : (high = middle);
  }
  return low - 1;
}
/** Where the next event (1) or the one before (-1) is, seen from a time: not those of the same moment. */
export function nextEvent(all: { positionS: number }[], s: number, way: 1 | -1): number | undefined {
  if (way > 0) return all[eventAt(all, s) + 1]?.positionS;
  return all[eventAt(all, s - 2 * NEAR_S)]?.positionS;
}
