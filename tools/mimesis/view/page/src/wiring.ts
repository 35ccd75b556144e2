// Who made what from what: as nodes tell it themselves on NODE/start, also in a log.
import { signal } from "@preact/signals";
import { isImage, type Connection } from "./connection";

export type Port = { topic: string; port: string; type: string };
export type Start = { node: string; inputs: Port[]; outputs: Port[]; clock?: string; header?: any };
export const starts = signal<ReadonlyMap<string, Start>>(new Map());

const followed = new Set<string>();
/** Reads the starts of all nodes, as they come. */
export function followStarts(connection: Connection) {
  for (const c of connection.channels.value.values()) {
    if (c.schemaName !== "mimesis.v1.NodeStart" || followed.has(c.topic)) continue;
    followed.add(c.topic);
    connection.listen(c.topic, (m) => (starts.value = new Map(starts.value).set(m.node, m)));
  }
}

/** The one image that annotations lie on: the first that their node takes, or one that it sends; of a node that tells nothing, the image
 * that shares most of the path, as of /front/annotations /front/image; undefined: nobody can tell. */
export function imageOf(annotations: string, images: string[], nodes: Iterable<Start>): string | undefined {
  for (const { inputs, outputs } of nodes) {
    if (!outputs.some((o) => o.topic === annotations)) continue;
    return [...inputs, ...outputs].find((p) => isImage(p.type) && images.includes(p.topic))?.topic;
  }
  const parts = annotations.split("/").filter(Boolean);
  const common = (topic: string) => {
    const other = topic.split("/").filter(Boolean);
    let n = 0;
    while (n < parts.length && parts[n] === other[n]) ++n;
    return n;
  };
  const most = Math.max(0, ...images.map(common)), near = images.filter((i) => common(i) === most);
  return most > 0 ? near[0] : images.length === 1 ? images[0] : undefined;
}
