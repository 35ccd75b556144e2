// Reads an MCAP file with the format's reference library, front to back with every sum checked and by its index,
// and prints {"streamed": {topic: count}, "indexed": {topic: count}, "digest": {...}, ...} as JSON.
const fs = require("fs");
const crypto = require("crypto");
const { McapStreamReader, McapIndexedReader } = require("@mcap/core");
const { loadDecompressHandlers } = require("@mcap/support");

function count(map, topic) {
  map[topic] = (map[topic] ?? 0) + 1;
}

async function main(file) {
  const decompressHandlers = await loadDecompressHandlers();
  const bytes = new Uint8Array(fs.readFileSync(file));
  const out = { streamed: {}, indexed: {}, sha256: "", schemas: {}, attachments: 0, metadata: 0 };

  const topics = new Map();
  const hash = crypto.createHash("sha256");
  const stream = new McapStreamReader({ validateCrcs: true, decompressHandlers });
  stream.append(bytes);
  for (let record; (record = stream.nextRecord()); ) {
    if (record.type === "Channel") topics.set(record.id, record.topic);
    if (record.type === "Schema") out.schemas[record.name] = record.data.length;
    if (record.type === "Attachment") out.attachments++;
    if (record.type === "Metadata") out.metadata++;
    if (record.type === "Message") {
      count(out.streamed, topics.get(record.channelId));
      hash.update(record.data);
    }
  }
  out.done = stream.done();
  out.sha256 = hash.digest("hex");

  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, length) => bytes.subarray(Number(offset), Number(offset + length)),
  };
  const indexed = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  let last = 0n;
  out.ordered = true;
  for await (const message of indexed.readMessages()) {
    count(out.indexed, indexed.channelsById.get(message.channelId).topic);
    out.ordered &&= message.logTime >= last;
    last = message.logTime;
  }
  console.log(JSON.stringify(out));
}

main(process.argv[2]).catch((e) => {
  console.error(String(e));
  process.exit(1);
});
