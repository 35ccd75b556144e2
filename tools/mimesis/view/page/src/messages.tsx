// The last message of a topic as a tree; what is searched, as a list. A number can be plotted.
import type { DescField, DescMessage } from "@bufbuild/protobuf";
import { useEffect, useRef, useState } from "preact/hooks";
import { typeOf } from "./connection";
import { curves, tab } from "./layouts";
import type { Props } from "./panels";
import { runS } from "./time";

export type Leaf = { path: string; name: string; text: string; number: boolean };
export type Branch = { path: string; name: string; parts: (Branch | Leaf)[]; left: number };
const EACH_MS = 200, MOST = 50; // between two looks; elements of a list that are shown

/** What a message holds, by the names of its fields. */
export function tree(message: any, type: DescMessage, path = "", name = ""): Branch {
  const parts: (Branch | Leaf)[] = [];
  for (const field of type.fields) {
    const value = message[field.localName], at = path ? `${path}.${field.name}` : field.name;
    if (value === undefined) continue;
    if (field.fieldKind === "list") {
      const shown = value.slice(0, MOST).map((v: any, i: number) => part(v, field, `${at}[${i}]`, `[${i}]`));
      parts.push({ path: at, name: `${field.name} (${value.length})`, parts: shown, left: value.length - shown.length });
    } else if (field.fieldKind === "map") {
      parts.push({ path: at, name: field.name, parts: Object.entries(value).map(([k, v]) => leaf(v, `${at}.${k}`, k)), left: 0 });
    } else parts.push(part(value, field, at, field.name));
  }
  return { path, name, parts, left: 0 };
}

function part(value: any, field: DescField, path: string, name: string): Branch | Leaf {
  if (field.message) return tree(value, field.message, path, name);
  if (field.enum) return { path, name, text: field.enum.value[value]?.name ?? String(value), number: true };
  return leaf(value, path, name);
}

function leaf(value: any, path: string, name: string): Leaf {
  const number = typeof value === "number" || typeof value === "bigint" || typeof value === "boolean";
  const text = value instanceof Uint8Array ? `${value.length} bytes` : typeof value === "number" ? String(+value.toPrecision(9)) : String(value);
  return { path, name, text, number };
}

export const leaves = (branch: Branch): Leaf[] => branch.parts.flatMap((p) => ("parts" in p ? leaves(p) : [p]));

function Value({ topic, of, name }: { topic: string; of: Leaf; name: string }) {
  const plot = () => ((curves.value = [...curves.value, { topic, path: of.path }]), (tab.value = "Plots"));
  return <li>{name}: <b>{of.text}</b> {of.number && <button onClick={plot} aria-label={`Plot ${of.path}`}>plot</button>}</li>;
}

function Parts({ topic, of }: { topic: string; of: Branch }) {
  return (
    <ul>
      {of.parts.map((p) => ("parts" in p
        ? <li key={p.path}><details open={p.parts.length < 8}><summary>{p.name}</summary><Parts topic={topic} of={p} /></details></li>
        : <Value key={p.path} topic={topic} of={p} name={p.name} />))}
      {of.left > 0 && <li>and {of.left} more</li>}
    </ul>
  );
}

export function Messages({ connection }: Props) {
  const topics = [...connection.channels.value.keys()].sort();
  const [chosen, setChosen] = useState(""), [search, setSearch] = useState("");
  const [seen, setSeen] = useState<{ topic: string; root: Branch; ns: bigint }>();
  const topic = topics.includes(chosen) ? chosen : topics[0] ?? "";
  const channel = connection.channels.value.get(topic), latest = useRef<[any, bigint] | undefined>(undefined);
  useEffect(() => {
    const type = channel && typeOf(channel);
    if (!type) return;
    latest.current = undefined;
    const end = connection.listen(topic, (m, ns) => (latest.current = [m, ns]));
    const timer = setInterval(() => {
      if (!latest.current) return;
      setSeen({ topic, root: tree(latest.current[0], type), ns: latest.current[1] });
      latest.current = undefined;
    }, EACH_MS);
    return () => { end(), clearInterval(timer); };
  }, [channel]);
  const words = search.toLowerCase().split(/\s+/).filter(Boolean), shown = seen?.topic === topic ? seen : undefined;
  const found = shown && words.length ? leaves(shown.root).filter((l) => words.every((w) => `${l.path} ${l.text}`.toLowerCase().includes(w))) : undefined;
  return (
    <>
      <p><label>Topic <select value={topic} onChange={(e) => setChosen(e.currentTarget.value)}>{topics.map((t) => <option key={t}>{t}</option>)}</select></label></p>
      <p><label>Search <input type="search" value={search} placeholder="name or value" onInput={(e) => setSearch(e.currentTarget.value)} /></label></p>
      <p>{channel?.schemaName} {shown && `at ${runS(shown.ns).toFixed(3)} s`}</p>
      <div class="tree">{!shown ? <p>No message so far.</p> : !found ? <Parts topic={topic} of={shown.root} /> : !found.length ? <p>Nothing in it is called so.</p>
        : <ul>{found.map((l) => <Value key={l.path} topic={topic} of={l} name={l.path} />)}</ul>}
      </div>
    </>
  );
}
