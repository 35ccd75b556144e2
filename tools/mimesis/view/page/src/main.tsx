import { render } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { Connection } from "./connection";
import { Fields, Images, Log, Nodes, Parameters } from "./panels";
import { Player } from "./player";
import { Plots } from "./plots";
import { film } from "./film";
import { choose, fitting, hidden, layout, LAYOUTS, load, saved, tab } from "./layouts";
import { Messages } from "./messages";
import { Scene } from "./scene";
import { status } from "./time";
import { Why } from "./why";
import { followStarts } from "./wiring";
import "uplot/dist/uPlot.min.css";
import "./style.css";

const query = new URLSearchParams(location.search), key = query.get("key");
const connection = new Connection(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/${key ? `?key=${encodeURIComponent(key)}` : ""}`);
const TABS = { Nodes, Images, Fields, Plots, Why, Log, Messages, Parameters };
type Tab = keyof typeof TABS;

function Stage() {
  const canvas = useRef<HTMLCanvasElement>(null), scene = useRef<Scene | undefined>(undefined);
  const [error, setError] = useState("");
  useEffect(() => {
    try {
      scene.current = new Scene(canvas.current!, query.has("film"));
      (window as any).mimesisScene = scene.current; // for tests and the console
    } catch (e) {
      setError(`no 3-D here: ${e instanceof Error ? e.message : e}`);
    }
  }, []);
  const channels = connection.channels.value;
  useEffect(() => {
    let last = 0;
    return status.subscribe((now) => { // a seek to before
      if (now && now.positionS < last) scene.current?.rewind(now.logTimeNs);
      last = now?.positionS ?? 0;
    });
  }, []);
  useEffect(() => scene.current?.follow(connection), [channels]);
  const drawn = [...channels.values()].filter((c) => c.schemaName === "foxglove.SceneUpdate").map((c) => c.topic).sort();
  useEffect(() => scene.current?.hide(hidden.value), [hidden.value]);
  useEffect(() => {
    if (layout.value?.camera.length) scene.current?.aim(layout.value.camera);
    scene.current?.accompany(layout.value?.accompany ?? "");
  }, [layout.value]);
  const show = (topic: string, shown: boolean) => (hidden.value = shown ? hidden.value.filter((t) => t !== topic) : [...hidden.value, topic]);
  useEffect(() => { if (query.has("film") && scene.current) film(connection, scene.current, query); }, []);
  return (
    <section class="stage" aria-label="Scene">
      <canvas ref={canvas} tabIndex={0} aria-label="3-D scene: drag turns, wheel zooms, right button moves" />
      {error && <p>{error}</p>}
      <div class="look">
        {drawn.length > 1 && <details><summary>Shown</summary>{drawn.map((t) => (
          <label key={t}><input type="checkbox" checked={!hidden.value.includes(t)} onChange={(e) => show(t, e.currentTarget.checked)} /> {t}</label>))}
        </details>}
        <button onClick={() => scene.current?.look()} title="f">Fit</button>
      </div>
    </section>
  );
}

function download() {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([saved()], { type: "application/json" }));
  link.download = `${layout.value?.name.toLowerCase() ?? "mimesis"}.layout.json`;
  link.click();
  URL.revokeObjectURL(link.href);
}

function App() {
  const [byHand, setByHand] = useState(false);
  useEffect(() => followStarts(connection), [connection.channels.value]);
  const fits = fitting(new Set([...connection.channels.value.values()].map((c) => c.topic)));
  useEffect(() => { if (!byHand && connection.channels.value.size && fits !== layout.value) choose(fits); }, [fits, byHand, connection.channels.value]);
  useEffect(() => {
    const press = (e: KeyboardEvent) => {
      if (e.target instanceof HTMLInputElement || e.target instanceof HTMLSelectElement) return;
      const t = Object.keys(TABS)[Number(e.key) - 1] as Tab | undefined;
      if (t) tab.value = t;
      if (e.key === "f") (window as any).mimesisScene?.look();
    };
    addEventListener("keydown", press);
    return () => removeEventListener("keydown", press);
  }, []);
  const Panel = TABS[tab.value as Tab] ?? Nodes;
  return (
    <>
      <header>
        <h1>{connection.name.value || "Mimesis"}</h1>
        <span role="status" class={connection.connected.value ? "good" : "bad"}>{connection.connected.value ? "connected" : "not connected: trying again"}</span>
        {connection.complaint.value && <span class="bad">{connection.complaint.value}</span>}
        <label>Layout <select value={layout.value?.name ?? ""} onChange={(e) => { setByHand(true); choose(LAYOUTS.find((l) => l.name === e.currentTarget.value)!); }}>
          {LAYOUTS.map((l) => <option key={l.name}>{l.name}</option>)}
        </select></label>
        <button onClick={() => layout.value && choose(layout.value, true)} title="as it was before you changed it">Reset</button>
        <button onClick={download} title="a file for others">Save</button>
        <label class="file">Load <input type="file" accept=".json" onChange={async (e) => {
          const file = e.currentTarget.files?.[0];
          if (!file) return;
          const wrong = load(await file.text());
          wrong ? (connection.complaint.value = `${file.name}: ${wrong}`) : setByHand(true);
        }} /></label>
      </header>
      <main>
        <Stage />
        <section class="side" aria-label="Panels">
          <div role="tablist">
            {(Object.keys(TABS) as Tab[]).map((t, i) => (
              <button key={t} role="tab" id={`tab-${t}`} aria-selected={t === tab.value} aria-controls="panel" title={String(i + 1)} onClick={() => (tab.value = t)}>{t}</button>
            ))}
          </div>
          <div role="tabpanel" id="panel" aria-labelledby={`tab-${tab.value}`} tabIndex={0}><Panel connection={connection} /></div>
        </section>
      </main>
      <Player connection={connection} />
    </>
  );
}

render(query.has("film") ? <Stage /> : <App />, document.getElementById("app")!);
