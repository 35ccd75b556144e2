// write_mcap.js FILE CODEC: 500 messages on two topics, an attachment and a metadata record, with the format's reference
// library. CODEC: none, zstd, or lz4 (by the program lz4: the library's own module only unpacks).
const fs = require("fs");
const { execFileSync } = require("child_process");
const { McapWriter } = require("@mcap/core");
const zstd = require("@foxglove/wasm-zstd");

const compressors = {
  none: undefined,
  zstd: (data) => ({ compression: "zstd", compressedData: zstd.compress(data, 3) }),
  lz4: (data) => ({
    compression: "lz4",
    compressedData: execFileSync("lz4", ["-c", "-q"], { input: data, maxBuffer: 1 << 28 }),
  }),
};

async function main(file, codec) {
  await zstd.isLoaded;
  const parts = [];
  let size = 0;
  const writable = {
    position: () => BigInt(size),
    write: async (bytes) => {
      parts.push(Buffer.from(bytes));
      size += bytes.length;
    },
  };
  const writer = new McapWriter({ writable, chunkSize: 4096, compressChunk: compressors[codec] });
  await writer.start({ profile: "", library: "peer" });
  const schemaId = await writer.registerSchema({
    name: "peer.Text", encoding: "jsonschema", data: new TextEncoder().encode("{}") });
  const ids = [];
  for (const topic of ["peer/even", "peer/odd"]) {
    ids.push(await writer.registerChannel({
      topic, schemaId, messageEncoding: "json", metadata: new Map([["node", "peer"]]) }));
  }
  for (let i = 0; i < 500; ++i) {
    await writer.addMessage({
      channelId: ids[i % 2], sequence: i, logTime: BigInt(1000 + i), publishTime: BigInt(i),
      data: new TextEncoder().encode(JSON.stringify({ i })) });
  }
  await writer.addAttachment({
    name: "note.txt", mediaType: "text/plain", logTime: 5n, createTime: 4n,
    data: new TextEncoder().encode("from the peer") });
  await writer.addMetadata({ name: "peer", metadata: new Map([["codec", codec]]) });
  await writer.end();
  fs.writeFileSync(file, Buffer.concat(parts));
}

main(process.argv[2], process.argv[3]).catch((e) => {
  console.error(String(e));
  process.exit(1);
});
