// Writes 500 messages on two topics with the format's reference library, uncompressed, as argv[2].
const fs = require("fs");
const { McapWriter } = require("@mcap/core");

async function main(file) {
  const parts = [];
  let size = 0;
  const writable = {
    position: () => BigInt(size),
    write: async (bytes) => {
      parts.push(Buffer.from(bytes));
      size += bytes.length;
    },
  };
  const writer = new McapWriter({ writable, chunkSize: 4096 });
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
  await writer.end();
  fs.writeFileSync(file, Buffer.concat(parts));
}

main(process.argv[2]).catch((e) => {
  console.error(String(e));
  process.exit(1);
});
