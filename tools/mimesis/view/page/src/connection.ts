// The Foxglove WebSocket protocol as a client speaks it, with messages decoded by the types that
// the server advertises.
import { createFileRegistry, fromBinary, toBinary, create, type DescMessage, type Message, type Registry } from "@bufbuild/protobuf";
import { FileDescriptorSetSchema } from "@bufbuild/protobuf/wkt";
import { signal } from "@preact/signals";

export interface Channel {
  id: number;
  topic: string;
  schemaName: string;
  schema: string;
}
interface Half {
  schemaName: string;
  schema: string;
}
export interface Service {
  id: number;
  name: string;
  request: Half;
  response: Half;
}
export interface Graph {
  published: Map<string, string[]>;
  subscribed: Map<string, string[]>;
}
/** A decoded message and the time of its content [ns]. */
export type Listener = (message: any, ns: bigint) => void;

export const isImage = (type: string) => type === "foxglove.RawImage" || type === "foxglove.CompressedImage";
const SUBPROTOCOLS = ["foxglove.sdk.v1", "foxglove.websocket.v1"];
const RETRY_MS = 1000, COMPLAINT_MS = 3000;
const MESSAGE = 1, TIME = 2, ANSWER = 3, CALL = 2;

const bytesOf = (base64: string) => Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));

/** Types by the text of their descriptors: many channels share them. */
const registries = new Map<string, Registry>();
export function typeOf(half: Half): DescMessage | undefined {
  let registry = registries.get(half.schema);
  if (!registry) {
    registry = createFileRegistry(fromBinary(FileDescriptorSetSchema, bytesOf(half.schema)));
    registries.set(half.schema, registry);
  }
  return registry.getMessage(half.schemaName);
}

export class Connection {
  readonly connected = signal(false);
  readonly name = signal("");
  readonly channels = signal<ReadonlyMap<string, Channel>>(new Map());
  readonly services = signal<ReadonlyMap<string, Service>>(new Map());
  readonly graph = signal<Graph>({ published: new Map(), subscribed: new Map() });
  /** The last complaint of the server; empty: none. */
  readonly complaint = signal("");
  /** Newest time that a message had [ns]. */
  now = 0n;
  /** May change parameters and call services. */
  trusted = false;

  private socket?: WebSocket;
  private readonly listeners = new Map<string, Set<Listener>>();
  private readonly subscriptions = new Map<number, { topic: string; type: DescMessage }>();
  private readonly ids = new Map<string, number>(); // subscription by topic
  private readonly calls = new Map<number, { type: DescMessage; done: (m: any) => void; fail: (e: Error) => void }>();
  private nextId = 1;
  private forgetting: ReturnType<typeof setTimeout> | undefined;

  constructor(private readonly url: string) {
    this.open();
  }

  /** Calls `listener` for the messages of a topic, now or once it is there. Returns how to end that. */
  listen(topic: string, listener: Listener): () => void {
    let all = this.listeners.get(topic);
    if (!all) this.listeners.set(topic, (all = new Set()));
    all.add(listener);
    this.subscribe(topic);
    return () => {
      all.delete(listener);
      if (all.size > 0) return;
      this.listeners.delete(topic);
      const id = this.ids.get(topic);
      if (id === undefined) return;
      this.ids.delete(topic);
      this.subscriptions.delete(id);
      this.say({ op: "unsubscribe", subscriptionIds: [id] });
    };
  }

  /** Answer of a service, or why there is none. */
  call(name: string, request: object): Promise<any> {
    const service = this.services.value.get(name);
    const asked = service && typeOf(service.request), answer = service && typeOf(service.response);
    if (!service || !asked || !answer) return Promise.reject(new Error(`there is no service ${name}`));
    const payload = toBinary(asked, create(asked, request as any));
    const call = this.nextId++;
    const bytes = new Uint8Array(13 + 8 + payload.length);
    const view = new DataView(bytes.buffer);
    view.setUint8(0, CALL);
    view.setUint32(1, service.id, true);
    view.setUint32(5, call, true);
    view.setUint32(9, 8, true);
    bytes.set(new TextEncoder().encode("protobuf"), 13);
    bytes.set(payload, 21);
    return new Promise((done, fail) => {
      this.calls.set(call, { type: answer, done, fail });
      this.socket?.send(bytes);
    });
  }

  private say(json: object) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(json));
  }

  private open() {
    const socket = new WebSocket(this.url, SUBPROTOCOLS);
    this.socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.connected.value = true;
      this.say({ op: "subscribeConnectionGraph" });
    };
    socket.onmessage = ({ data }) => (typeof data === "string" ? this.text(JSON.parse(data)) : this.binary(data));
    socket.onclose = () => {
      this.connected.value = false;
      this.channels.value = new Map();
      this.services.value = new Map();
      this.subscriptions.clear();
      this.ids.clear();
      for (const { fail } of this.calls.values()) fail(new Error("the connection ended"));
      this.calls.clear();
      setTimeout(() => this.open(), RETRY_MS);
    };
  }

  private subscribe(topic: string) {
    const channel = this.channels.value.get(topic);
    if (!channel || this.ids.has(topic) || !this.listeners.has(topic)) return;
    const type = typeOf(channel);
    if (!type) return;
    const id = this.nextId++;
    this.ids.set(topic, id);
    this.subscriptions.set(id, { topic, type });
    this.say({ op: "subscribe", subscriptions: [{ id, channelId: channel.id }] });
  }

  private isImage(topic: string): boolean {
    return isImage(this.channels.value.get(topic)?.schemaName ?? "");
  }

  private text(json: any) {
    switch (json.op) {
      case "serverInfo":
        this.name.value = json.name;
        this.trusted = json.capabilities.includes("services");
        break;
      case "advertise": {
        const channels = new Map(this.channels.value);
        for (const c of json.channels as Channel[]) channels.set(c.topic, c);
        this.channels.value = channels;
        for (const c of json.channels as Channel[]) this.subscribe(c.topic);
        break;
      }
      case "unadvertise": {
        const gone = new Set<number>(json.channelIds);
        for (const [topic, c] of this.channels.value) {
          const id = this.ids.get(topic);
          if (!gone.has(c.id) || id === undefined) continue;
          this.ids.delete(topic);
          this.subscriptions.delete(id);
        }
        this.channels.value = new Map([...this.channels.value].filter(([, c]) => !gone.has(c.id)));
        break;
      }
      case "advertiseServices":
        this.services.value = new Map([...this.services.value, ...json.services.map((s: Service) => [s.name, s] as const)]);
        break;
      case "unadvertiseServices": {
        const gone = new Set<number>(json.serviceIds);
        this.services.value = new Map([...this.services.value].filter(([, s]) => !gone.has(s.id)));
        break;
      }
      case "connectionGraphUpdate": {
        const { published, subscribed } = this.graph.value;
        const next: Graph = { published: new Map(published), subscribed: new Map(subscribed) };
        for (const name of json.removedTopics) next.published.delete(name), next.subscribed.delete(name);
        for (const t of json.publishedTopics) next.published.set(t.name, t.publisherIds);
        for (const t of json.subscribedTopics) next.subscribed.set(t.name, t.subscriberIds);
        this.graph.value = next;
        break;
      }
      case "serviceCallFailure":
        this.calls.get(json.callId)?.fail(new Error(json.message));
        this.calls.delete(json.callId);
        break;
      case "status":
        if (json.level === 0 || (json.id === "slow" && this.isImage(json.message.split(" ").pop()))) break; // images come as fast as they can
        this.complaint.value = json.message;
        clearTimeout(this.forgetting);
        if (json.id) this.forgetting = setTimeout(() => (this.complaint.value = ""), COMPLAINT_MS); // repeated while it is so
        break;
    }
  }

  private binary(buffer: ArrayBuffer) {
    const view = new DataView(buffer);
    switch (view.getUint8(0)) {
      case MESSAGE: {
        const subscription = this.subscriptions.get(view.getUint32(1, true));
        if (!subscription) return;
        this.now = view.getBigUint64(5, true);
        const message: Message = fromBinary(subscription.type, new Uint8Array(buffer, 13));
        for (const listener of this.listeners.get(subscription.topic) ?? []) listener(message, this.now);
        break;
      }
      case TIME:
        this.now = view.getBigUint64(1, true);
        break;
      case ANSWER: {
        const call = view.getUint32(5, true), waiting = this.calls.get(call);
        if (!waiting) return;
        this.calls.delete(call);
        waiting.done(fromBinary(waiting.type, new Uint8Array(buffer, 13 + view.getUint32(9, true))));
        break;
      }
    }
  }
}
