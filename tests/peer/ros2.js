// ros2.js write FILE: one message of each common type of ROS 2 humble, filled at random, by @foxglove/rosmsg2-serialization.
// ros2.js read FILE: reads each message of a bag in MCAP by the definitions in it, and holds these against ROS's own.
// ros2.js compare < lines of `mimesis log cat --bytes hex`: prints how many messages hold the same, and what differs.
const fs = require("fs");
const { McapStreamReader, McapWriter } = require("@mcap/core");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader, MessageWriter } = require("@foxglove/rosmsg2-serialization");
const { ros2humble } = require("@foxglove/rosmsg-msgs-common");

let state = 1;
const draw = () => (state = (state * 48271) % 2147483647) / 2147483647;
const whole = (bits, signed) => Math.floor((draw() - (signed ? 0.5 : 0)) * 2 ** bits);

// As the library wants it, and as our JSON shows it.
function value(field) {
  const type = field.type;
  if (type === "bool") return draw() < 0.5 ? [true, true] : [false, false];
  if (type === "string") {
    const text = "word " + whole(16);
    return [text, text];
  }
  if (type === "time" || type === "duration") {
    const sec = whole(30), nsec = whole(29);
    return [{ sec, nsec }, { sec, nanosec: nsec }];
  }
  const number = /^(u?)int(8|16|32|64)$/.exec(type);
  if (number && number[2] === "64") {
    const x = BigInt(whole(50, !number[1]));
    return [x, Number(x)];
  }
  if (number) return Array(2).fill(whole(Number(number[2]), !number[1]));
  if (type === "float32") return Array(2).fill(Math.fround(draw() * 100 - 50));
  if (type === "float64") return Array(2).fill(draw() * 100 - 50);
  return message(ros2humble[type]);
}
function message(definition) {
  const theirs = {}, ours = {};
  for (const field of definition.definitions) {
    if (field.isConstant) continue;
    if (!field.isArray) {
      [theirs[field.name], ours[field.name]] = value(field);
      continue;
    }
    const n = field.arrayLength ?? Math.min(1 + whole(2), field.arrayUpperBound ?? 4);
    const all = Array.from({ length: n }, () => value(field));
    theirs[field.name] = all.map((v) => v[0]);
    ours[field.name] = field.type === "uint8" ? Buffer.from(all.map((v) => v[1])).toString("hex") : all.map((v) => v[1]);
  }
  return [theirs, ours];
}
function types(name, found = new Map()) {
  if (found.has(name)) return found;
  found.set(name, ros2humble[name]);
  for (const f of ros2humble[name].definitions) if (f.isComplex) types(f.type, found);
  return found;
}
const builtin = { time: "builtin_interfaces/Time", duration: "builtin_interfaces/Duration" };
function lines(definition) {
  return definition.definitions.map((f) => f.isConstant ? `${f.type} ${f.name}=${f.valueText ?? f.value}`
    : `${builtin[f.type] ?? f.type}${f.isArray ? `[${f.arrayLength ?? (f.arrayUpperBound ? "<=" + f.arrayUpperBound : "")}]` : ""} ${f.name}`)
    .join("\n");
}
function text(name) {
  const [own, ...others] = types(name);
  const separator = "=".repeat(80);
  return lines(own[1]) + "\n" + others.map(([type, d]) => `${separator}\nMSG: ${type}\n${lines(d)}\n`).join("");
}
const names = Object.keys(ros2humble).filter((n) => n !== "builtin_interfaces/Time" && n !== "builtin_interfaces/Duration").sort();

async function write(file) {
  const parts = [];
  let size = 0;
  const writer = new McapWriter({ writable: {
    position: () => BigInt(size),
    write: async (bytes) => { parts.push(Buffer.from(bytes)); size += bytes.length; } } });
  await writer.start({ profile: "ros2", library: "peer" });
  for (const [i, name] of names.entries()) {
    const schemaId = await writer.registerSchema({ name: name.replace("/", "/msg/"), encoding: "ros2msg", data: Buffer.from(text(name)) });
    const channelId = await writer.registerChannel({ topic: name, schemaId, messageEncoding: "cdr", metadata: new Map() });
    // The library does not write what has no fields; ROS sends a byte for it.
    const empty = ros2humble[name].definitions.every((f) => f.isConstant), content = message(ros2humble[name])[0];
    const data = empty ? Buffer.from([0, 1, 0, 0, 0]) : new MessageWriter([...types(name).values()]).writeMessage(content);
    await writer.addMessage({ channelId, sequence: i, logTime: BigInt(i), publishTime: BigInt(i), data });
  }
  await writer.end();
  fs.writeFileSync(file, Buffer.concat(parts));
}
function same(a, b) {
  if (typeof a === "number" && typeof b === "number") return Math.abs(a - b) <= 1e-6 * Math.abs(b);
  if (typeof a !== "object" || typeof b !== "object") return a === b;
  const keys = Object.keys(b);
  return Object.keys(a).length === keys.length && keys.every((k) => same(a[k], b[k]));
}
function compare() {
  const shown = new Map(fs.readFileSync(0, "utf8").split("\n").filter(Boolean).map(JSON.parse).map((m) => [m.topic, m.message]));
  let equal = 0;
  for (const name of names) {
    const wanted = message(ros2humble[name])[1], found = shown.get(name);
    if (found !== undefined && same(found, wanted)) ++equal;
    else console.log(name, JSON.stringify(found), JSON.stringify(wanted));
  }
  console.log(`${equal} of ${names.length} equal`);
}
async function read(file) {
  const { loadDecompressHandlers } = require("@mcap/support");
  const reader = new McapStreamReader({ decompressHandlers: await loadDecompressHandlers() });
  reader.append(fs.readFileSync(file));
  const schemas = new Map(), channels = new Map(), all = {};
  const plain = (d) => JSON.stringify((d?.definitions ?? []).filter((f) => !f.isConstant).map((f) => [f.type, f.name, !!f.isArray, f.arrayLength]));
  for (let r; (r = reader.nextRecord()); ) {
    if (r.type === "Schema") schemas.set(r.id, r);
    if (r.type === "Channel" && !channels.has(r.id)) {
      const schema = schemas.get(r.schemaId), parsed = parse(Buffer.from(schema.data).toString(), { ros2: true });
      const own = parsed.find((d) => !d.name) ?? parsed[0];
      const differ = parsed.filter((d) => plain(d) !== plain(ros2humble[d === own ? schema.name.replace("/msg/", "/") : d.name]))
        .map((d) => d.name ?? schema.name);
      channels.set(r.id, { reader: new MessageReader(parsed), topic: r.topic });
      all[r.topic] = { type: schema.name, encoding: r.messageEncoding, differ, messages: 0 };
    }
    if (r.type !== "Message") continue;
    const channel = channels.get(r.channelId), message = channel.reader.readMessage(r.data);
    ++all[channel.topic].messages;
    all[channel.topic].last = JSON.parse(JSON.stringify(message, (k, v) => (ArrayBuffer.isView(v) ? { length: v.length, first: [...v.subarray(0, 3)].map(Number) } : v)));
  }
  console.log(JSON.stringify(all));
}
const [verb, file] = process.argv.slice(2);
verb === "write" ? write(file) : verb === "read" ? read(file) : compare();
