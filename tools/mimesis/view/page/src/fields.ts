// Numbers in messages: which there are, and their value by path.
import { ScalarType, type DescField, type DescMessage } from "@bufbuild/protobuf";

const DEEPEST = 5;
const NUMBERS = new Set([
  ScalarType.DOUBLE, ScalarType.FLOAT, ScalarType.INT32, ScalarType.UINT32, ScalarType.SINT32, ScalarType.FIXED32,
  ScalarType.SFIXED32, ScalarType.INT64, ScalarType.UINT64, ScalarType.SINT64, ScalarType.FIXED64, ScalarType.SFIXED64,
  ScalarType.BOOL,
]);

/** Paths of all fields that can be plotted: "header.seq", "position_rad[0]", "joints[0].torque". */
export function paths(type: DescMessage, deepest = DEEPEST): string[] {
  const found: string[] = [];
  const visit = (message: DescMessage, prefix: string, depth: number) => {
    if (depth === 0) return;
    for (const field of message.fields) {
      const name = prefix + field.name + (field.fieldKind === "list" ? "[0]" : "");
      const inner = messageOf(field);
      if (inner) visit(inner, name + ".", depth - 1);
      else if (isNumber(field)) found.push(name);
    }
  };
  visit(type, "", deepest);
  return found;
}

function messageOf(field: DescField): DescMessage | undefined {
  if (field.fieldKind === "message") return field.message;
  return field.fieldKind === "list" && field.listKind === "message" ? field.message : undefined;
}

function isNumber(field: DescField): boolean {
  if (field.fieldKind === "enum") return true;
  if (field.fieldKind === "scalar") return NUMBERS.has(field.scalar);
  return field.fieldKind === "list" && (field.listKind === "enum" || (field.listKind === "scalar" && NUMBERS.has(field.scalar)));
}

/** As in protobuf's JavaScript: position_rad -> positionRad. */
const local = (name: string) => name.replace(/_([a-z0-9])/g, (_, c: string) => c.toUpperCase());

/** The number at a path; NaN: it is not there. */
export function valueAt(message: any, path: string): number {
  let at = message;
  for (const part of path.split(/[.[\]]+/)) {
    if (part === "") continue;
    if (at === undefined || at === null) return NaN;
    at = /^\d+$/.test(part) ? at[Number(part)] : at[local(part)];
  }
  if (typeof at === "boolean") return at ? 1 : 0;
  return at === undefined || at === null ? NaN : Number(at);
}
