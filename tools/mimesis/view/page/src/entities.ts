// The entities of a scene as they come, change, end and are taken back by a seek.
import type { Group } from "three";
import { build, dispose } from "./shapes";

const FOREVER = 1n << 63n;
const nsOf = (t: any): bigint => (t ? BigInt(t.seconds) * 1_000_000_000n + BigInt(t.nanos) : 0n); // of a time, or a duration

type Entity = { topic: string; id: string; stampNs: bigint; endNs: bigint; group: Group };

export class Entities {
  private readonly all = new Map<string, Entity>(); // by topic and id

  /** `shaded`: as build. `placed` puts a new one into the frame of this name. */
  constructor(private readonly shaded: boolean, private readonly placed: (group: Group, frame: string) => void) {}

  get size(): number {
    return this.all.size;
  }
  keys(): IterableIterator<string> {
    return this.all.keys();
  }
  *of(topic: string): Generator<Group> {
    for (const e of this.all.values()) if (e.topic === topic) yield e.group;
  }
  *shown(): Generator<Group> {
    for (const e of this.all.values()) if (e.group.visible) yield e.group;
  }
  hide(topics: ReadonlySet<string>) {
    for (const e of this.all.values()) e.group.visible = !topics.has(e.topic);
  }

  /** Takes a SceneUpdate of this time [ns]. */
  update(topic: string, message: any, ns: bigint, visible = true) {
    this.remove((e) => e.endNs < ns); // of any topic: one whose lifetime is over may be the last of its own
    for (const gone of message.deletions) this.remove((e) => e.topic === topic && (e.id === gone.id || gone.type === 1));
    for (const entity of message.entities) {
      this.remove((e) => e.topic === topic && e.id === entity.id);
      const group = build(entity, this.shaded), stampNs = nsOf(entity.timestamp) || ns, lifetimeNs = nsOf(entity.lifetime);
      group.visible = visible;
      this.placed(group, entity.frameId);
      this.all.set(`${topic}\n${entity.id}`, { topic, id: entity.id, stampNs, endNs: lifetimeNs ? stampNs + lifetimeNs : FOREVER, group });
    }
  }

  /** What was not there yet at this time [ns] goes. */
  rewind(ns: bigint) {
    this.remove((e) => e.stampNs > ns);
  }

  private remove(which: (e: Entity) => boolean) {
    for (const [key, entity] of this.all) {
      if (!which(entity)) continue;
      dispose(entity.group);
      this.all.delete(key);
    }
  }
}
