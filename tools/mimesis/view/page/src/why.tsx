// A run as a person would tell it: what was seen, decided, planned, and what stopped. A line leads to its time.
import { useEffect, useRef, useState } from "preact/hooks";
import type { Props } from "./panels";
import { eventAt, events, KINDS, marks, playerOf, seek, status } from "./time";

export function Why({ connection }: Props) {
  const [search, setSearch] = useState(""), [all, setAll] = useState(false);
  const list = useRef<HTMLOListElement>(null);
  const words = search.toLowerCase().split(/\s+/);
  const shown = (all ? marks : events).value.filter((m) => words.every((w) => `${m.node} ${KINDS[m.kind]} ${m.text} ${m.details.join(" ")}`.toLowerCase().includes(w)));
  const here = eventAt(shown, status.value?.positionS ?? 0);
  useEffect(() => list.current?.children[here]?.scrollIntoView({ block: "nearest" }), [here]);
  if (!playerOf(connection)) return <p>A log tells why: `mimesis view LOG`. Of a graph that runs, see Log.</p>;
  return (
    <>
      <p><label>Search <input type="search" value={search} onInput={(e) => setSearch(e.currentTarget.value)} /></label>{" "}
        <label><input type="checkbox" checked={all} onChange={(e) => setAll(e.currentTarget.checked)} /> Log lines</label></p>
      {!shown.length && <p>Nothing is told.</p>}
      <ol class="why" ref={list}>{shown.map((m, i) => (
        <li key={i} class={KINDS[m.kind]} aria-current={i === here ? "time" : undefined}>
          <button onClick={() => seek(connection, m.positionS)}><time>{m.positionS.toFixed(2)} s</time> <b>{m.node}</b> <span class={m.level > 2 ? "bad" : ""}>{m.text}</span></button>
          {m.details.length > 0 && <details><summary>why</summary><ul>{m.details.map((d: string) => <li key={d}>{d}</li>)}</ul></details>}
        </li>))}
      </ol>
    </>
  );
}
