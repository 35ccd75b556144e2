// foxglove_client.js URL TOPIC N: what Foxglove's own client makes of a server, as JSON: N messages of the topic, decoded by the
// advertised type, parameters, the graph and the answer of the first service.
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { protobufFromBinaryDescriptor } = require("@mcap/support");
const WebSocket = require("ws");

const [url, topic, count] = process.argv.slice(2);
const socket = new WebSocket(url, [FoxgloveClient.SUPPORTED_SUBPROTOCOL, "foxglove.sdk.v1"]);
const client = new FoxgloveClient({ ws: socket });
const seen = { messages: [], stamps: [], parameters: null, published: [], answer: null, errors: [] };
let type;

function done() {
  if (seen.messages.length < Number(count) || !seen.parameters || !seen.published.length || seen.answer === null) return;
  seen.protocol = socket.protocol;
  console.log(JSON.stringify(seen));
  process.exit(0);
}
client.on("error", (e) => seen.errors.push(String(e)));
client.on("serverInfo", (info) => {
  seen.capabilities = info.capabilities;
  client.getParameters([], "all");
  client.subscribeConnectionGraph();
});
client.on("advertise", (channels) => {
  for (const channel of channels) {
    if (channel.topic !== topic) continue;
    type = protobufFromBinaryDescriptor(Buffer.from(channel.schema, "base64")).lookupType(channel.schemaName);
    client.subscribe(channel.id);
  }
});
client.on("message", ({ timestamp, data }) => {
  if (seen.messages.length >= Number(count)) return;
  seen.messages.push(type.decode(new Uint8Array(data.buffer, data.byteOffset, data.byteLength)));
  seen.stamps.push(String(timestamp));
  done();
});
client.on("parameterValues", ({ parameters }) => ((seen.parameters = Object.fromEntries(parameters.map((p) => [p.name, p.value]))), done()));
client.on("connectionGraphUpdate", ({ publishedTopics }) => (seen.published.push(...publishedTopics.map((t) => t.name)), done()));
client.on("advertiseServices", ([service]) =>
  client.sendServiceCallRequest({ serviceId: service.id, callId: 1, encoding: "protobuf", data: new DataView(new ArrayBuffer(0)) }));
client.on("serviceCallResponse", ({ callId, data }) => ((seen.answer = callId === 1 ? data.byteLength : -1), done()));
setTimeout(() => (console.log(JSON.stringify(seen)), process.exit(1)), 15000);
