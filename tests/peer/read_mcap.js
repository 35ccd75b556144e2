// Reads MCAP files with the format's reference library, each front to back with every sum checked and, if it was closed,
// by its index too. Prints a JSON array with one object per file:
// {"file", "streamed": {topic: count}, "indexed": {topic: count} or null, "digest", "done", "ordered", ...}
const fs = require("fs");
const { McapStreamReader, McapIndexedReader } = require("@mcap/core");
const { loadDecompressHandlers } = require("@mcap/support");

function count(map, topic) {
  map[topic] = (map[topic] ?? 0) + 1;
}

// FNV-1a, 32 bits.
function digest(sum, bytes) {
  for (let i = 0; i < bytes.length; ++i) sum = Math.imul(sum ^ bytes[i], 16777619);
  return sum;
}

function readStream(bytes, decompressHandlers, out) {
  const topics = new Map();
  const stream = new McapStreamReader({ validateCrcs: true, decompressHandlers });
  stream.append(bytes);
  let sum = 2166136261 | 0;
  for (let record; (record = stream.nextRecord()); ) {
    if (record.type === "Channel") topics.set(record.id, record.topic);
    if (record.type === "Schema") out.schemas[record.name] = record.data.length;
    if (record.type === "Attachment") out.attachments++;
    if (record.type === "Metadata") out.metadata++;
    if (record.type === "Message") {
      count(out.streamed, topics.get(record.channelId));
      sum = digest(sum, record.data);
    }
  }
  out.done = stream.done();
  out.digest = sum >>> 0;
}

async function readIndexed(bytes, decompressHandlers, out) {
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, length) => bytes.subarray(Number(offset), Number(offset + length)),
  };
  const indexed = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  out.indexed = {};
  out.ordered = true;
  let last = 0n;
  for await (const message of indexed.readMessages({ validateCrcs: true })) {
    count(out.indexed, indexed.channelsById.get(message.channelId).topic);
    out.ordered &&= message.logTime >= last;
    last = message.logTime;
  }
}

async function main(files) {
  const decompressHandlers = await loadDecompressHandlers();
  const all = [];
  for (const file of files) {
    const out = { file, streamed: {}, indexed: null, schemas: {}, attachments: 0, metadata: 0 };
    const bytes = new Uint8Array(fs.readFileSync(file));
    readStream(bytes, decompressHandlers, out);
    if (out.done) await readIndexed(bytes, decompressHandlers, out);
    all.push(out);
  }
  console.log(JSON.stringify(all));
}

main(process.argv.slice(2)).catch((e) => {
  console.error(String(e));
  process.exit(1);
});
