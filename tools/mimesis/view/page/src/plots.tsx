// Fields over time: the last seconds of a graph that runs, the whole of a log.
import { signal } from "@preact/signals";
import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import uPlot from "uplot";
import { typeOf, type Connection } from "./connection";
import { paths, valueAt } from "./fields";
import { curves, type Curve } from "./layouts";
import type { Props } from "./panels";
import { hasWallTime, originNs, playerOf, runS, seek, status } from "./time";

const COLOURS = ["#e8853a", "#3f88c5", "#44a568", "#c44e8a", "#8a6fd1", "#c9b037", "#4bb3b8", "#d1495b"];
const SPAN_S = 20, MOST = 4000, HEIGHT = 260;
const LOOK_MS = 150; // between two looks at a log that is still being read
const wall = signal(false); // label the axis with the time of the wall

export function Plots({ connection }: Props) {
  const [search, setSearch] = useState("");
  const channels = connection.channels.value;
  const all = useMemo(() => [...channels.values()].flatMap((c) => {
    const type = typeOf(c);
    return type ? paths(type).map((path) => ({ topic: c.topic, path })) : [];
  }), [channels]);
  const words = search.toLowerCase().split(/\s+/);
  const found = search ? all.filter((c) => words.every((w) => `${c.topic}.${c.path}`.toLowerCase().includes(w))).slice(0, 30) : [];
  return (
    <>
      <label>Field <input type="search" value={search} placeholder="for instance: bridge position" onInput={(e) => setSearch(e.currentTarget.value)} /></label>
      <ul class="found">{found.map((c) => (
        <li key={c.topic + c.path}><button onClick={() => { curves.value = [...curves.value, c]; setSearch(""); }}>{c.topic} · {c.path}</button></li>))}
      </ul>
      {curves.value.length ? <Plot connection={connection} /> : <p>Search a field of any message and choose it.</p>}
      {hasWallTime.value && <label><input type="checkbox" checked={wall.value} onChange={(e) => (wall.value = e.currentTarget.checked)} /> Time of day</label>}
      <ul class="found">{curves.value.map((c, i) => (
        <li key={i}><button title="remove" onClick={() => (curves.value = curves.value.filter((_, k) => k !== i))}>
          <span style={{ color: COLOURS[i % COLOURS.length] }}>■</span> {c.topic} · {c.path} ✕</button></li>))}
      </ul>
    </>
  );
}

const label = (s: number) => (wall.value && hasWallTime.value ? new Date(originNs.value / 1e6 + 1e3 * s).toISOString().slice(11, 21) : String(+s.toFixed(6)));

/** Of a log a value that a message does not have is a gap. */
function chart(box: HTMLElement, shown: Curve[], log: boolean, more: Partial<uPlot.Options>): uPlot {
  const axis = { stroke: getComputedStyle(box).color, grid: { stroke: "#8884", width: 1 } };
  return new uPlot({
    width: box.clientWidth, height: HEIGHT, legend: { show: false },
    axes: [{ ...axis, label: wall.value && hasWallTime.value ? "time of day, UTC" : "time of the run [s]", labelSize: 18, values: (_, ticks) => ticks.map(label) }, axis],
    series: [{}, ...shown.map((_, i) => ({ stroke: COLOURS[i % COLOURS.length], width: 1.5, spanGaps: !log, points: { show: false } }))], ...more,
  }, [[0], ...shown.map(() => [null])] as any, box);
}

/** A curve as far as a window shows it, with its values at the window's edges. */
export function within(t: number[], y: number[], from: number, to: number): number[] {
  const seen = y.filter((_, i) => t[i]! >= from && t[i]! <= to);
  for (const edge of [from, to]) {
    const after = t.findIndex((at) => at > edge);
    if (after > 0) seen.push(y[after - 1]! + ((edge - t[after - 1]!) / (t[after]! - t[after - 1]!)) * (y[after]! - y[after - 1]!));
  }
  return seen;
}

/** Least and largest of what is seen, and a little room. */
function fitted(values: number[][]): { min: number; max: number } | undefined {
  let low = Infinity, high = -Infinity;
  for (const series of values) for (const v of series) if (isFinite(v)) (low = Math.min(low, v)), (high = Math.max(high, v));
  const room = 0.05 * (high - low) || 0.05 * Math.abs(high) || 1;
  return low <= high ? { min: low - room, max: high + room } : undefined;
}

/** The last seconds of a graph that runs; how to end. */
function follow(connection: Connection, box: HTMLElement, shown: Curve[]): [uPlot, () => void] {
  const points = shown.map(() => ({ t: [] as number[], y: [] as number[] }));
  const plot = chart(box, shown, false, { cursor: { drag: { x: false, y: false } }, scales: { x: { time: false } } });
  const ends = shown.map((curve, i) => connection.listen(curve.topic, (m, ns) => {
    const { t, y } = points[i]!, now = runS(ns);
    if (t.length && now < t[t.length - 1]!) (t.length = 0), (y.length = 0); // a new run
    t.push(now), y.push(valueAt(m, curve.path));
    if (t.length > MOST) t.splice(0, MOST / 4), y.splice(0, MOST / 4);
  }));
  const timer = setInterval(() => {
    const newest = Math.max(...points.map((p) => p.t[p.t.length - 1] ?? -Infinity));
    if (!isFinite(newest)) return;
    plot.setData(uPlot.join(points.map(({ t, y }) => [t, y]) as any), false);
    plot.setScale("x", { min: newest - SPAN_S, max: newest });
    const y = fitted(points.map(({ t, y }) => y.filter((_, k) => t[k]! >= newest - SPAN_S)));
    if (y) plot.setScale("y", y);
  }, 50);
  return [plot, () => { clearInterval(timer), ends.forEach((end) => end()); }];
}

/** A log from its first second to its last. Dragging zooms, a double click shows all again, a click goes there. */
function overview(connection: Connection, box: HTMLElement, shown: Curve[]): [uPlot, () => void] {
  const { startS, endS } = status.value, name = playerOf(connection)!;
  let from = startS, to = endS, timer = 0, asked = 0, ended = false;
  const draw = async () => {
    const mine = ++asked;
    const begun = performance.now();
    const answer = await connection.call(`${name}/curves`, { fields: shown, fromS: from, toS: to, columns: box.clientWidth }).catch(() => undefined);
    if (ended || mine !== asked || !answer) return;
    plot.setData(uPlot.join(answer.curves.map((c: any) => [c.positionS, c.value.map((v: number) => (isNaN(v) ? null : v))])) as any, false);
    plot.batch(() => {
      plot.setScale("x", { min: from, max: to });
      const y = fitted(answer.curves.map((c: any) => within(c.positionS, c.value, from, to)));
      if (y) plot.setScale("y", y);
    });
    const rest = answer.curves.filter((c: any) => !c.whole);
    box.title = answer.curves.map((c: any) => c.problem).filter(Boolean).join("; ") ||
      (rest.length ? `read up to ${Math.min(...rest.map((c: any) => c.readS)).toFixed(0)} s` : "");
    box.dataset.drawn = (performance.now() - begun).toFixed(0); // [ms], for tests
    box.dataset.whole = String(rest.length === 0);
    if (rest.length) timer = window.setTimeout(draw, LOOK_MS);
  };
  const show = (a: number, b: number) => {
    (from = Math.max(startS, a)), (to = Math.min(endS, b));
    if (to - from < 1e-6) (from = startS), (to = endS);
    clearTimeout(timer);
    draw();
  };
  const plot: uPlot = chart(box, shown, true, {
    scales: { x: { time: false, auto: false, range: () => [from, to] } },
    cursor: { drag: { x: true, y: false, setScale: false }, bind: { dblclick: () => () => (show(startS, endS), null) } },
    hooks: {
      setSelect: [(u) => { if (u.select.width > 3) show(u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x")); u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false); }],
      draw: [(u) => { // where the log is
        const x = u.valToPos(status.value?.positionS ?? 0, "x", true), { left, top, width, height } = u.bbox;
        if (x < left || x > left + width) return;
        u.ctx.fillStyle = getComputedStyle(box).color;
        u.ctx.fillRect(x, top, devicePixelRatio, height);
      }],
    },
  });
  let down = 0;
  plot.over.addEventListener("mousedown", (e) => (down = e.clientX));
  plot.over.addEventListener("click", (e) => { if (Math.abs(e.clientX - down) < 3) seek(connection, plot.posToVal(e.offsetX, "x")); });
  plot.over.addEventListener("wheel", (e) => {
    e.preventDefault();
    const at = plot.posToVal(e.offsetX, "x"), factor = e.deltaY > 0 ? 1.25 : 0.8;
    show(at - (at - from) * factor, at + (to - at) * factor);
  }, { passive: false });
  const stop = status.subscribe(() => plot.redraw(false));
  draw();
  return [plot, () => { ended = true; clearTimeout(timer), stop(); }];
}

function Plot({ connection }: Props) {
  const box = useRef<HTMLDivElement>(null), shown = curves.value, log = !!status.value && !!playerOf(connection);
  useEffect(() => {
    const here = box.current!;
    const [plot, end] = (log ? overview : follow)(connection, here, shown);
    const resize = new ResizeObserver(([seen]) => plot.setSize({ width: seen!.contentRect.width, height: HEIGHT }));
    resize.observe(here);
    return () => { resize.disconnect(), end(), plot.destroy(); };
  }, [shown, log, wall.value]);
  return <div ref={box} class="plot" role="img" aria-label={`Plot of ${shown.map((c) => `${c.topic} ${c.path}`).join(", ")}`} />;
}
