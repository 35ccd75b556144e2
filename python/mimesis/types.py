"""Message classes from serialised FileDescriptorSets, and the hash that tells whether two ends read bytes alike."""
import functools
import os
import pathlib

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import DecodeError

PROTOSET = "mimesis.protoset"  # all messages of the project, written by the build


class MessageTypeError(Exception):
    """A message type that is unknown, or not what the other end means by it."""


def _fields(part):
    """Of a file or of a message, with its extensions and nested types."""
    yield from part.extension
    for message in getattr(part, "message_type", ()) or getattr(part, "nested_type", ()):
        yield from message.field
        yield from _fields(message)


def _pool(descriptor_set):
    pool = descriptor_pool.DescriptorPool()
    try:
        files = descriptor_pb2.FileDescriptorSet.FromString(descriptor_set).file
        for file in files:  # imports come first
            for field in _fields(file):
                if field.options.weak:  # Protobuf ends a program that reads one
                    raise TypeError(f"field {field.name} is weak")
                field.ClearField("json_name")  # protoc writes it here, not into generated code: hashes are without
            pool.Add(file)
    except (DecodeError, TypeError) as error:
        raise MessageTypeError(f"no valid definition of types: {error}") from None
    return files, pool


@functools.lru_cache(maxsize=None)
def classes_of(descriptor_set):
    """Message classes by full name of one FileDescriptorSet (bytes). Sets may contradict each other: one pool a set."""
    files, pool = _pool(descriptor_set)
    factory = message_factory.MessageFactory(pool)
    found = {}

    def add(types):
        for descriptor in types:
            found[descriptor.full_name] = factory.GetPrototype(descriptor)
            add(descriptor.nested_types)

    for file in files:
        add(pool.FindFileByName(file.name).message_types_by_name.values())
    return found


@functools.lru_cache(maxsize=None)
def own_set():
    """The project's FileDescriptorSet: $MIMESIS_PROTOSET, or where the installation or the build put it."""
    here = pathlib.Path(__file__).resolve()
    places = [here.parent / PROTOSET]
    if os.environ.get("MIMESIS_PROTOSET"):
        places.insert(0, pathlib.Path(os.environ["MIMESIS_PROTOSET"]))
    if len(here.parents) > 2:
        places.append(here.parents[2] / "build" / "generated" / PROTOSET)  # source tree
    for place in places:
        if place.is_file():
            return place.read_bytes()
    raise MessageTypeError(f"no {PROTOSET} in {', '.join(str(p.parent) for p in places)}; set MIMESIS_PROTOSET")


def message_type(name):
    """The class of a message of this project, e.g. "mimesis.v1.Observation" or "foxglove.CompressedImage"."""
    try:
        return classes_of(own_set())[name]
    except KeyError:
        raise MessageTypeError(f"no message type '{name}' in {PROTOSET}") from None


def descriptor_set(descriptor):
    """Serialised FileDescriptorSet with the type's file and its imports, imports first."""
    out, seen = descriptor_pb2.FileDescriptorSet(), set()

    def add(file):
        if file.name in seen:
            return
        seen.add(file.name)
        for dependency in file.dependencies:
            add(dependency)
        file.CopyToProto(out.file.add())

    add(descriptor.file)
    return out.SerializeToString()


def type_hash(descriptor):
    """FNV-1a over the descriptors of a type and of all it uses, as common/runtime/type_info.h computes it."""
    parts = {}

    def add(kind, empty):
        kind.CopyToProto(empty)
        known = kind.full_name in parts
        parts.setdefault(kind.full_name, empty.SerializeToString())
        return not known

    def collect(kind):
        if not add(kind, descriptor_pb2.DescriptorProto()):
            return
        for field in kind.fields:
            if field.message_type is not None:
                collect(field.message_type)
            if field.enum_type is not None:
                add(field.enum_type, descriptor_pb2.EnumDescriptorProto())

    collect(descriptor)
    text = descriptor.full_name.encode()
    for name in sorted(parts):
        text += name.encode() + parts[name]
    value = 0xCBF29CE484222325
    for byte in text:
        value = ((value ^ byte) * 0x100000001B3) & 0xFFFFFFFFFFFFFFFF
    return value
