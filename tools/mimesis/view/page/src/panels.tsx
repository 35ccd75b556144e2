// What stands beside the scene: nodes, images, fields, plots, log, parameters, player.
import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import uPlot from "uplot";
import { typeOf, type Connection } from "./connection";
import { paths, valueAt } from "./fields";
import { annotate, pixels } from "./image";
import { curves } from "./layouts";

type Props = { connection: Connection };
const topicsOf = (connection: Connection, schema: string) =>
  [...connection.channels.value.values()].filter((c) => c.schemaName === schema).map((c) => c.topic).sort();
const own = (topic: string) => /\/(health|log|start|steps)$/.test(topic);
const ms = (s: number) => (s > 0 && isFinite(s) ? `${(1e3 * s).toFixed(s < 0.01 ? 2 : 0)} ms` : "-");

/** Health of a node, and messages a second since the one before. */
type Seen = { health: any; sentHz: number; stepHz: number; at: number };

export function Nodes({ connection }: Props) {
  const [seen, setSeen] = useState<Record<string, Seen>>({});
  const topics = topicsOf(connection, "mimesis.v1.Health");
  useEffect(() => {
    const ends = topics.map((topic) =>
      connection.listen(topic, (health) =>
        setSeen((before) => {
          const last = before[health.node]?.health;
          const s = last ? Number(health.header.stampNs - last.header.stampNs) / 1e9 : 0;
          const hz = (now: bigint, then?: bigint) => (s > 0 && then !== undefined ? Number(now - then) / s : NaN);
          return { ...before, [health.node]: { health, sentHz: hz(health.sent, last?.sent), stepHz: hz(health.steps, last?.steps), at: performance.now() } };
        })));
    return () => ends.forEach((end) => end());
  }, [topics.join()]);
  const graph = connection.graph.value, nodes = new Map<string, { out: string[]; in: string[] }>();
  const node = (name: string) => nodes.get(name) ?? nodes.set(name, { out: [], in: [] }).get(name)!;
  for (const [topic, who] of graph.published) if (!own(topic)) who.forEach((n) => node(n).out.push(topic));
  for (const [topic, who] of graph.subscribed) if (!own(topic)) who.forEach((n) => node(n).in.push(topic));
  const count = (hz: number | undefined) => (hz === undefined || isNaN(hz) ? "-" : hz.toFixed(0));
  return (
    <table>
      <thead><tr><th>Node</th><th>State</th><th>Steps/s</th><th>Sent/s</th><th title="worst input, 99th percentile">Latency</th><th title="oldest input">Age</th><th title="longest">Step</th></tr></thead>
      <tbody>
        {[...nodes].sort().map(([name, ports]) => {
          const s = seen[name], inputs: any[] = s?.health.inputs ?? [];
          const latency = Math.max(0, ...inputs.map((i) => i.latencyP99S));
          const age = Math.max(0, ...inputs.map((i) => i.ageS));
          return (
            <tr key={name}>
              <td>
                <details><summary>{name}</summary>
                  <ul>{ports.in.sort().map((t) => <li key={"i" + t}>← {t}</li>)}{ports.out.sort().map((t) => <li key={"o" + t}>→ {t}</li>)}</ul>
                </details>
              </td>
              <td>{s ? "ok" : "no health"}</td><td>{count(s?.stepHz)}</td><td>{count(s?.sentHz)}</td><td>{ms(latency)}</td><td>{ms(age)}</td>
              <td>{s ? ms(s.health.worstStepS) : "-"}</td>
            </tr>
          );
        })}
      </tbody>
    </table>
  );
}

export function Images({ connection }: Props) {
  const images = [...topicsOf(connection, "foxglove.RawImage"), ...topicsOf(connection, "foxglove.CompressedImage")];
  if (!images.length) return <p>No node sends images.</p>;
  return <>{images.map((topic) => <Picture key={topic} connection={connection} topic={topic} />)}</>;
}

function Picture({ connection, topic }: Props & { topic: string }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const [note, setNote] = useState("waiting for an image");
  const notes = topicsOf(connection, "foxglove.ImageAnnotations");
  useEffect(() => {
    const annotations = new Map<string, any>();
    let last: ImageBitmap | ImageData | undefined, due = false;
    const draw = () => {
      due = false;
      const c = canvas.current;
      if (!c || !last) return;
      if (c.width !== last.width || c.height !== last.height) (c.width = last.width), (c.height = last.height);
      const pen = c.getContext("2d")!;
      last instanceof ImageData ? pen.putImageData(last, 0, 0) : pen.drawImage(last, 0, 0);
      for (const a of annotations.values()) annotate(pen, a);
    };
    const soon = () => { if (!due) (due = true), requestAnimationFrame(draw); };
    const ends = notes.map((n) => connection.listen(n, (m) => (annotations.set(n, m), soon())));
    ends.push(connection.listen(topic, (m) => {
      if (m.format !== undefined) {
        createImageBitmap(new Blob([m.data])).then((b) => ((last = b), setNote(""), soon()), () => setNote(`no image that can be shown: ${m.format}`));
        return;
      }
      const seen = pixels(m);
      setNote(seen ? "" : m.data.length ? `no image that can be shown: ${m.encoding}` : "not in the log: mimesis view --images computes it again");
      if (seen) (last = seen), soon();
    }));
    return () => ends.forEach((end) => end());
  }, [topic, notes.join()]);
  return <figure><canvas ref={canvas} /><figcaption>{topic} {note && `(${note})`}</figcaption></figure>;
}

/** Activity of the neural fields: a column a message, a row a neuron. */
export function Fields({ connection }: Props) {
  const topics = topicsOf(connection, "mimesis.v1.FieldActivity");
  const [names, setNames] = useState<string[]>([]);
  const canvases = useRef(new Map<string, HTMLCanvasElement>());
  useEffect(() => {
    const ends = topics.map((topic) => connection.listen(topic, (m) => {
      const fresh = m.fields.map((f: any) => f.name);
      setNames((before) => (before.join() === fresh.join() ? before : fresh));
      for (const field of m.fields) column(canvases.current.get(field.name), field.u);
    }));
    return () => ends.forEach((end) => end());
  }, [topics.join()]);
  if (!topics.length) return <p>No node has neural fields.</p>;
  return <>{names.map((name) => (
    <figure class="field" key={name}>
      <canvas width={600} height={32} ref={(c) => { if (c) canvases.current.set(name, c); }} />
      <figcaption>{name}</figcaption>
    </figure>
  ))}</>;
}

/** Blue at rest, black at 0, orange when active. */
function column(canvas: HTMLCanvasElement | undefined, u: number[]) {
  if (!canvas || !u.length) return;
  if (canvas.height !== u.length) canvas.height = u.length;
  const pen = canvas.getContext("2d")!;
  pen.drawImage(canvas, -1, 0);
  const strip = pen.createImageData(1, u.length);
  u.forEach((value, i) => {
    const share = Math.abs(Math.tanh(value / 4)), at = 4 * (u.length - 1 - i);
    const [r, g, b] = value > 0 ? [255, 140, 25] : [40, 90, 190];
    strip.data.set([r! * share, g! * share, b! * share, 255], at);
  });
  pen.putImageData(strip, canvas.width - 1, 0);
}

const COLOURS = ["#e8853a", "#3f88c5", "#44a568", "#c44e8a", "#8a6fd1", "#c9b037", "#4bb3b8", "#d1495b"];
const SPAN_S = 20, MOST = 4000;

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
      <Plot connection={connection} />
      <ul class="found">{curves.value.map((c, i) => (
        <li key={i}><button title="remove" onClick={() => (curves.value = curves.value.filter((_, k) => k !== i))}>
          <span style={{ color: COLOURS[i % COLOURS.length] }}>■</span> {c.topic} · {c.path} ✕</button></li>))}
      </ul>
    </>
  );
}

function Plot({ connection }: Props) {
  const box = useRef<HTMLDivElement>(null);
  const shown = curves.value;
  useEffect(() => {
    if (!box.current || !shown.length) return;
    const points = shown.map(() => ({ t: [] as number[], y: [] as number[] }));
    const grey = getComputedStyle(box.current).color;
    const axis = { stroke: grey, grid: { stroke: "#8884", width: 1 } };
    const plot = new uPlot({
      width: box.current.clientWidth, height: 260, legend: { show: false }, cursor: { drag: { x: false, y: false } },
      scales: { x: { time: false } }, axes: [{ ...axis, label: "time [s]", labelSize: 18 }, axis],
      series: [{}, ...shown.map((_, i) => ({ stroke: COLOURS[i % COLOURS.length], width: 1.5, spanGaps: true }))],
    }, [[0], ...shown.map(() => [null])] as any, box.current);
    const ends = shown.map((curve, i) => connection.listen(curve.topic, (m, ns) => {
      const { t, y } = points[i]!, now = Number(ns) / 1e9;
      if (t.length && now < t[t.length - 1]!) (t.length = 0), (y.length = 0); // a seek, or a new run
      t.push(now), y.push(valueAt(m, curve.path));
      if (t.length > MOST) t.splice(0, MOST / 4), y.splice(0, MOST / 4);
    }));
    const timer = setInterval(() => {
      const newest = Math.max(...points.map((p) => p.t[p.t.length - 1] ?? -Infinity));
      if (!isFinite(newest)) return;
      plot.setData(uPlot.join(points.map(({ t, y }) => [t, y]) as any), false);
      plot.setScale("x", { min: newest - SPAN_S, max: newest });
      const inside = points.flatMap(({ t, y }) => y.filter((v, k) => t[k]! >= newest - SPAN_S && isFinite(v)));
      if (!inside.length) return;
      const low = Math.min(...inside), high = Math.max(...inside), room = 0.05 * (high - low) || 0.05 * Math.abs(high) || 1;
      plot.setScale("y", { min: low - room, max: high + room });
    }, 50);
    const resize = new ResizeObserver(([seen]) => plot.setSize({ width: seen!.contentRect.width, height: 260 }));
    resize.observe(box.current);
    return () => { clearInterval(timer), resize.disconnect(), ends.forEach((end) => end()), plot.destroy(); };
  }, [shown]);
  return <div ref={box} class="plot">{!shown.length && <p>Search a field of any message and choose it.</p>}</div>;
}

const LEVELS = ["", "debug", "info", "warning", "error", "fatal"];
export function Log({ connection }: Props) {
  const [lines, setLines] = useState<{ key: number; s: string; level: number; node: string; text: string }[]>([]);
  const topics = topicsOf(connection, "foxglove.Log");
  const next = useRef(0);
  useEffect(() => {
    const ends = topics.map((topic) => connection.listen(topic, (m, ns) => {
      const line = { key: next.current++, s: (Number(ns % 100_000_000_000_000n) / 1e9).toFixed(3), level: m.level, node: m.name, text: m.message };
      setLines((before) => [...before.slice(-499), line]);
    }));
    return () => ends.forEach((end) => end());
  }, [topics.join()]);
  return <ol class="log" reversed>{[...lines].reverse().map((l) => (
    <li key={l.key} class={LEVELS[l.level]}><time>{l.s}</time> <b>{l.node}</b> {l.level > 2 ? LEVELS[l.level] + ": " : ""}{l.text}</li>))}
  </ol>;
}

export function Parameters({ connection }: Props) {
  const nodes = [...connection.services.value.keys()].filter((s) => s.endsWith("/params")).map((s) => s.slice(0, -7)).sort();
  const [node, setNode] = useState("");
  const [all, setAll] = useState<any[]>([]);
  const [said, setSaid] = useState("");
  const chosen = node || nodes[0] || "";
  const ask = async (set: object[] = []): Promise<void> => {
    try {
      setAll((await connection.call(`${chosen}/params`, { set, described: true })).params);
      setSaid(set.length ? "taken" : "");
    } catch (e) {
      setSaid((e as Error).message);
      if (set.length) ask(); // what is in force
    }
  };
  useEffect(() => { if (chosen) ask(); }, [chosen, connection.services.value]);
  if (!nodes.length) return <p>{connection.trusted ? "No node here has parameters." : "Open the address that `mimesis view` printed, with its key, to see and change parameters."}</p>;
  return (
    <>
      <label>Node <select value={chosen} onChange={(e) => setNode(e.currentTarget.value)}>{nodes.map((n) => <option key={n}>{n}</option>)}</select></label>
      <output>{said}</output>
      <table>
        <tbody>{all.map((p) => (
          <tr key={chosen + p.key} title={[p.meaning, p.allowed].filter(Boolean).join("; ")}>
            <th scope="row">{p.key}</th>
            <td>{p.changeable
              ? <input aria-label={p.key} value={p.value} onChange={(e) => ask([{ key: p.key, value: e.currentTarget.value }])} />
              : p.value}</td>
            <td>{p.unit}</td>
          </tr>))}
        </tbody>
      </table>
    </>
  );
}

/** The time line of a log: services of a player. */
export function Player({ connection }: Props) {
  const services = connection.services.value;
  const name = [...services.keys()].find((s) => services.get(s)!.response.schemaName === "mimesis.v1.PlayerStatus" && s.endsWith("/status"))?.slice(0, -7);
  const [status, setStatus] = useState<any>();
  const ask = (what: string, request: object = {}) => { if (name) connection.call(`${name}/${what}`, request).then(setStatus, () => {}); };
  const [marks, setMarks] = useState<any[]>([]);
  useEffect(() => {
    if (!name) return;
    const look = (): unknown => connection.call(`${name}/marks`, {}).then((m) => (setMarks(m.marks), m.whole || setTimeout(look, 500)), () => {});
    look();
  }, [name]);
  useEffect(() => {
    if (!name) return;
    const timer = setInterval(() => ask("status"), 200);
    const press = (e: KeyboardEvent) => {
      if (e.target instanceof HTMLInputElement || e.target instanceof HTMLSelectElement) return;
      if (e.key === " ") ask(paused.current ? "resume" : "pause"), e.preventDefault();
      if (e.key === "ArrowLeft") ask("seek", seekBy(-5));
      if (e.key === "ArrowRight") ask("seek", seekBy(5));
      if (e.key === "s") ask("step");
    };
    addEventListener("keydown", press);
    return () => { clearInterval(timer), removeEventListener("keydown", press); };
  }, [name]);
  const paused = useRef(false);
  paused.current = !!status?.paused;
  if (!name || !status) return null;
  const seekBy = (s: number) => ({ target: { case: "offsetS", value: s } });
  return (
    <section class="player" aria-label="Time line of the log">
      <button onClick={() => ask(status.paused ? "resume" : "pause")} title="space">{status.paused ? "Play" : "Pause"}</button>
      <button onClick={() => ask("step")} title="s">Step</button>
      <div class="line"><svg aria-hidden="true" viewBox="0 0 1000 8" preserveAspectRatio="none">{marks.map((m, i) => (
        <rect key={i} class={m.level > 2 ? "bad" : ""} x={(1000 * (m.positionS - status.startS)) / (status.endS - status.startS || 1)} width="2" height="8"
          onClick={() => ask("seek", { target: { case: "positionS", value: m.positionS } })}><title>{`${m.positionS.toFixed(2)} s, ${m.node}: ${m.text}`}</title></rect>))}
      </svg>
      <input type="range" aria-label="Time" min={status.startS} max={status.endS} step="0.01" value={status.positionS}
        onInput={(e) => ask("seek", { target: { case: "positionS", value: Number(e.currentTarget.value) } })} /></div>
      <span>{status.positionS.toFixed(2)} / {status.endS.toFixed(2)} s</span>
      <label>Speed <select value={String(status.rate)} onChange={(e) => ask("rate", { rate: Number(e.currentTarget.value) })}>
        {[...new Set([0.1, 0.25, 0.5, 1, 2, 5, 10, status.rate])].sort((a, b) => a - b).map((r) => <option key={r} value={String(r)}>{r}×</option>)}
      </select></label>
    </section>
  );
}
