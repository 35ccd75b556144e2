// foxglove_protos.js FOLDER: writes the published foxglove.* schemas as FOLDER/foxglove/NAME.proto.
const fs = require("fs");
const path = require("path");
const { foxgloveMessageSchemas, foxgloveEnumSchemas, generateProto } = require("@foxglove/schemas/internal");

const folder = path.join(process.argv[2], "foxglove");
fs.mkdirSync(folder, { recursive: true });
for (const schema of Object.values(foxgloveMessageSchemas)) {
  const enums = Object.values(foxgloveEnumSchemas).filter((e) => e.parentSchemaName === schema.name);
  fs.writeFileSync(path.join(folder, schema.name + ".proto"), generateProto(schema, enums));
}
