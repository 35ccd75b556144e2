import { expect, test } from "vitest";
import { FileDescriptorProtoSchema, TimestampSchema } from "@bufbuild/protobuf/wkt";
import { paths, valueAt } from "../src/fields";

test("paths name what can be plotted", () => {
  expect(paths(TimestampSchema)).toEqual(["seconds", "nanos"]);
  const file = paths(FileDescriptorProtoSchema, 3);
  expect(file).toContain("message_type[0].field[0].number");
  expect(file).toContain("public_dependency[0]");
  expect(file).not.toContain("name"); // a text
});

test("values are found by path", () => {
  const message = { header: { stampNs: 5n }, positionRad: [0.5, -1], deep: [{ on: true }] };
  expect(valueAt(message, "header.stamp_ns")).toBe(5);
  expect(valueAt(message, "position_rad[1]")).toBe(-1);
  expect(valueAt(message, "deep[0].on")).toBe(1);
  for (const missing of ["position_rad[2]", "nothing.at.all", "deep[1].on"]) expect(valueAt(message, missing)).toBeNaN();
});
