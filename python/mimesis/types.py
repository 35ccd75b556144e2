"""Message classes from serialised FileDescriptorSets, and the hash that tells whether two ends read bytes alike."""
import functools
import os
import pathlib

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

PROTOSET = "mimesis.protoset"  # all messages of the project, written by the build


class MessageTypeError(Exception):
    """A message type that is unknown, or not what the other end means by it."""


def _forget_json_names(messages):
    """protoc writes them into sets of files, but not into generated code: hashes are over descriptors without."""
    for message in messages:
        for field in message.field:
            field.ClearField("json_name")
        _forget_json_names(message.nested_type)


@functools.lru_cache(maxsize=None)
def classes_of(descriptor_set):
    """Message classes by full name of one FileDescriptorSet (bytes). Sets may contradict each other: one pool a set."""
    files = descriptor_pb2.FileDescriptorSet.FromString(descriptor_set)
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:  # imports come first
        _forget_json_names(file.message_type)
        pool.Add(file)
    factory = message_factory.MessageFactory(pool)
    found = {}

    def add(types):
        for descriptor in types:
            found[descriptor.full_name] = factory.GetPrototype(descriptor)
            add(descriptor.nested_types)

    for file in files.file:
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
