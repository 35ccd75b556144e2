// The time line of a log: services of a player.
import { useEffect } from "preact/hooks";
import type { Props } from "./panels";
import { ask, eventAt, events, KINDS, marks, nextEvent, playerOf, seek, status } from "./time";

const POLL_MS = 200;
const typing = (e: Event) => e.target instanceof HTMLInputElement || e.target instanceof HTMLSelectElement;

export function Player({ connection }: Props) {
  const name = playerOf(connection), now = status.value;
  const jump = (way: 1 | -1) => {
    const to = nextEvent(events.value, status.value.positionS, way);
    if (to !== undefined) seek(connection, to);
  };
  useEffect(() => {
    if (!name) return;
    const look = (): unknown => connection.call(`${name}/marks`, {}).then((m) => ((marks.value = m.marks), m.whole || setTimeout(look, 500)), () => {});
    look();
  }, [name]);
  useEffect(() => {
    if (!name) return;
    const seekBy = (s: number) => ask(connection, "seek", { target: { case: "offsetS", value: s } });
    const timer = setInterval(() => ask(connection, "status"), POLL_MS);
    const press = (e: KeyboardEvent) => {
      if (typing(e)) return;
      if (e.key === " ") ask(connection, status.value?.paused ? "resume" : "pause"), e.preventDefault();
      if (e.key === "ArrowLeft") seekBy(-5);
      if (e.key === "ArrowRight") seekBy(5);
      if (e.key === "s") ask(connection, "step");
      if (e.key === "n") jump(1);
      if (e.key === "p") jump(-1);
    };
    addEventListener("keydown", press);
    return () => { clearInterval(timer), removeEventListener("keydown", press), (status.value = undefined); };
  }, [name]);
  if (!name || !now) return null;
  const last = events.value[eventAt(events.value, now.positionS)], x = (s: number) => (1000 * (s - now.startS)) / (now.endS - now.startS || 1);
  return (
    <section class="player" aria-label="Time line of the log">
      <button onClick={() => ask(connection, now.paused ? "resume" : "pause")} title="space">{now.paused ? "Play" : "Pause"}</button>
      <button onClick={() => ask(connection, "step")} title="s">Step</button>
      <button onClick={() => jump(-1)} title="p: the event before" aria-label="Event before">‹</button>
      <button onClick={() => jump(1)} title="n: the next event" aria-label="Next event">›</button>
      <div class="line"><svg aria-hidden="true" viewBox="0 0 1000 8" preserveAspectRatio="none">{marks.value.map((m, i) => (
        <rect key={i} class={m.level > 2 ? "bad" : KINDS[m.kind]} x={x(m.positionS)} width="2" height="8"
          onClick={() => seek(connection, m.positionS)}><title>{`${m.positionS.toFixed(2)} s, ${m.node}: ${m.text}`}</title></rect>))}
      </svg>
      <input type="range" aria-label="Time" min={now.startS} max={now.endS} step="0.01" value={now.positionS}
        onInput={(e) => seek(connection, Number(e.currentTarget.value))} />
      <output class="told">{last ? `${last.positionS.toFixed(2)} s: ${last.node} ${last.text}` : ""}</output></div>
      <span>{now.positionS.toFixed(2)} / {now.endS.toFixed(2)} s</span>
      <label>Speed <select value={String(now.rate)} onChange={(e) => ask(connection, "rate", { rate: Number(e.currentTarget.value) })}>
        {[...new Set([0.1, 0.25, 0.5, 1, 2, 5, 10, now.rate])].sort((a, b) => a - b).map((r) => <option key={r} value={String(r)}>{r}×</option>)}
      </select></label>
    </section>
  );
}
