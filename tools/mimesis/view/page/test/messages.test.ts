import { create } from "@bufbuild/protobuf";
import { FileDescriptorProtoSchema } from "@bufbuild/protobuf/wkt";
import { expect, test, vi } from "vitest";

vi.stubGlobal("localStorage", { getItem: () => null, setItem: () => {}, removeItem: () => {} });
const { leaves, tree } = await import("../src/messages");

test("a message is a tree by the names of its fields, whose numbers can be plotted by their paths", () => {
  const message = create(FileDescriptorProtoSchema, {
    name: "a.proto", publicDependency: [3, 4], messageType: [{ name: "A", field: [{ name: "x", number: 7, type: 1 }] }],
  });
  const all = leaves(tree(message, FileDescriptorProtoSchema));
  const of = (path: string) => all.find((l) => l.path === path);
  expect(of("name")).toMatchObject({ text: "a.proto", number: false });
  expect(of("public_dependency[1]")).toMatchObject({ text: "4", number: true });
  expect(of("message_type[0].field[0].number")).toMatchObject({ text: "7", number: true });
  expect(of("message_type[0].field[0].type")!.text).toMatch(/DOUBLE/);
});

test("long lists are cut, and say so", () => {
  const message = create(FileDescriptorProtoSchema, { publicDependency: Array.from({ length: 1000 }, (_, i) => i) });
  const list = tree(message, FileDescriptorProtoSchema).parts.find((p) => p.path === "public_dependency");
  expect(list).toMatchObject({ name: "public_dependency (1000)", left: 950 });
});
