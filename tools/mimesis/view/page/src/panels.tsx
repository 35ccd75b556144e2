// What stands beside the scene: nodes, images, fields, log, parameters.
import { useEffect, useRef, useState } from "preact/hooks";
import { isImage, type Connection } from "./connection";
import { annotate, pixels } from "./image";
import { playerOf, runS, status } from "./time";
import { imageOf, starts } from "./wiring";

export type Props = { connection: Connection };
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
  if (playerOf(connection)) {
    for (const { node: name, inputs, outputs } of starts.value.values()) { // those of the log
      outputs.forEach(({ topic }) => own(topic) || node(name).out.push(topic));
      inputs.forEach(({ topic }) => own(topic) || node(name).in.push(topic));
    }
  } else {
    for (const [topic, who] of graph.published) if (!own(topic)) who.forEach((n) => node(n).out.push(topic));
    for (const [topic, who] of graph.subscribed) if (!own(topic)) who.forEach((n) => node(n).in.push(topic));
  }
  if (!nodes.size) return <p>No node is told of.</p>;
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
  const images = [...connection.channels.value.values()].filter((c) => isImage(c.schemaName)).map((c) => c.topic).sort();
  if (!images.length) return <p>No node sends images.</p>;
  const over = topicsOf(connection, "foxglove.ImageAnnotations").map((t) => [t, imageOf(t, images, starts.value.values())] as const);
  const lost = over.filter(([, image]) => !image).map(([t]) => t);
  return (
    <>
      <Restored />
      {images.map((topic) => <Picture key={topic} connection={connection} topic={topic} notes={over.filter(([, image]) => image === topic).map(([t]) => t)} />)}
      {lost.length > 0 && <p>Not drawn, as nothing tells their image: {lost.join(", ")}</p>}
    </>
  );
}

/** Images that the log does not hold are computed while it is shown. */
function Restored() {
  const { restored = 0n, elided = 0n, restoreProblem = "" } = status.value ?? {};
  if (restoreProblem) return <p class="bad">Images are not stored in this log, and cannot be computed again: {restoreProblem}</p>;
  if (!elided || restored === elided) return null;
  return (
    <p><label>Images are not stored in this log; their cameras compute them again, those of now first:{" "}
      <progress value={Number(restored)} max={Number(elided)} /></label> {String(restored)} of {String(elided)}</p>
  );
}

const OLD_NS = 2.5e8, KEPT = 64; // annotations of an image so much older or newer say nothing of this one
/** When the image was taken: by its own time if it has one, else that of the message. */
const takenNs = (t: any, ns: bigint) => (t && (t.seconds || t.nanos) ? Number(t.seconds) * 1e9 + t.nanos : Number(ns));

/** Whether an element is in view: images are large, and only those that are looked at are received. */
function useInView(element: { current: Element | null }): boolean {
  const [inView, setInView] = useState(false);
  useEffect(() => {
    const watch = new IntersectionObserver((seen) => setInView(seen[seen.length - 1]!.isIntersecting));
    watch.observe(element.current!);
    return () => watch.disconnect();
  }, []);
  return inView;
}

function Picture({ connection, topic, notes }: Props & { topic: string; notes: string[] }) {
  const figure = useRef<HTMLElement>(null), canvas = useRef<HTMLCanvasElement>(null), inView = useInView(figure);
  const [empty, setEmpty] = useState(true);
  const [note, setNote] = useState("waiting for an image");
  useEffect(() => {
    if (!inView) return;
    const annotations = new Map<string, { taken: number; m: any }[]>(); // the last ones: an image may come after those of later images
    let last: ImageBitmap | ImageData | undefined, due = false, taken = NaN;
    const draw = () => {
      due = false;
      const c = canvas.current;
      if (!c || !last) return;
      setEmpty(false);
      if (c.width !== last.width || c.height !== last.height) (c.width = last.width), (c.height = last.height);
      const pen = c.getContext("2d")!;
      last instanceof ImageData ? pen.putImageData(last, 0, 0) : pen.drawImage(last, 0, 0);
      const texts: Parameters<typeof annotate>[2] = [];
      for (const all of annotations.values()) {
        const near = all.reduce((best, a) => (Math.abs(a.taken - taken) <= Math.abs(best.taken - taken) ? a : best));
        if (Math.abs(near.taken - taken) <= OLD_NS) annotate(pen, near.m, texts);
      }
    };
    const soon = () => { if (!due) (due = true), requestAnimationFrame(draw); };
    const ends = notes.map((n) => connection.listen(n, (m, ns) => {
      const first = m.circles[0] ?? m.points[0] ?? m.texts[0];
      annotations.set(n, [...(annotations.get(n) ?? []).slice(1 - KEPT), { taken: takenNs(first?.timestamp, ns), m }]);
      soon();
    }));
    ends.push(connection.listen(topic, (m, ns) => {
      if (!m.data.length) return setNote(last ? "the one of now is being computed" : "is being computed");
      taken = takenNs(m.timestamp, ns);
      if (m.format !== undefined) {
        createImageBitmap(new Blob([m.data])).then((b) => ((last = b), setNote(""), soon()), () => setNote(`no image that can be shown: ${m.format}`));
        return;
      }
      const seen = pixels(m);
      setNote(seen ? "" : `no image that can be shown: ${m.encoding}`);
      if (seen) (last = seen), soon();
    }));
    return () => ends.forEach((end) => end());
  }, [topic, notes.join(), inView]);
  return <figure ref={figure}><canvas ref={canvas} hidden={empty} /><figcaption>{topic} {note && `(${note})`}</figcaption></figure>;
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

const LEVELS = ["", "debug", "info", "warning", "error", "fatal"];
export function Log({ connection }: Props) {
  const [lines, setLines] = useState<{ key: number; s: string; level: number; node: string; text: string }[]>([]);
  const topics = topicsOf(connection, "foxglove.Log");
  const next = useRef(0);
  useEffect(() => {
    const ends = topics.map((topic) => connection.listen(topic, (m, ns) => {
      const line = { key: next.current++, s: runS(ns).toFixed(3), level: m.level, node: m.name, text: m.message };
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
