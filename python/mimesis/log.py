"""Messages of MCAP logs [mcap.dev/spec], in the order of the file."""
import ctypes
import ctypes.util
import dataclasses
import struct
import typing

from . import types

MAGIC = b"\x89MCAP0\r\n"
SCHEMA, CHANNEL, MESSAGE, CHUNK, DATA_END = 0x03, 0x04, 0x05, 0x06, 0x0F


class LogError(Exception):
    """A file that is no MCAP log, or is damaged; names the place."""


@dataclasses.dataclass(frozen=True)
class Logged:
    topic: str
    message: typing.Any
    log_time_ns: int
    publish_time_ns: int
    seq: int


class _Fields:
    """Reads the fields of one record in order."""

    def __init__(self, data):
        self._data, self._at = data, 0

    def number(self, form):
        value, = struct.unpack_from("<" + form, self._data, self._at)
        self._at += struct.calcsize("<" + form)
        return value

    def bytes(self, form="I"):
        size = self.number(form)
        if self._at + size > len(self._data):
            raise struct.error(f"{size} bytes wanted, {len(self._data) - self._at} left")
        self._at += size
        return self._data[self._at - size:self._at]

    def text(self):
        return bytes(self.bytes()).decode()

    def rest(self):
        return bytes(self._data[self._at:])


def _library(name):
    found = ctypes.util.find_library(name)
    if not found:
        raise LogError(f"the log is compressed and lib{name} is not installed")
    return ctypes.CDLL(found)


def _decompress(how, data, size):
    if how == "":
        return data
    out = ctypes.create_string_buffer(max(size, 1))
    source = bytes(data)
    if how == "zstd":
        zstd = _library("zstd")
        zstd.ZSTD_decompress.restype = ctypes.c_size_t
        zstd.ZSTD_decompress.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t]
        got = zstd.ZSTD_decompress(out, size, source, len(source))
    elif how == "lz4":
        lz4, context = _library("lz4"), ctypes.c_void_p()
        lz4.LZ4F_decompress.restype = ctypes.c_size_t
        lz4.LZ4F_createDecompressionContext(ctypes.byref(context), 100)
        written, read = ctypes.c_size_t(size), ctypes.c_size_t(len(source))
        lz4.LZ4F_decompress(context, out, ctypes.byref(written), source, ctypes.byref(read), None)
        lz4.LZ4F_freeDecompressionContext(context)
        got = written.value
    else:
        raise LogError(f"compression '{how}' is unknown, expected zstd, lz4 or none")
    if got != size:
        raise LogError(f"a chunk is damaged: it does not become {size} bytes")
    return memoryview(out.raw)[:size]


def _records(data, inside):
    """(kind, content) of each record. One that is cut off is an error inside of a chunk; else a recorder was killed."""
    at, head = 0, 9
    while at < len(data):
        kind, size = struct.unpack_from("<BQ", data, at) if at + head <= len(data) else (0, len(data))
        if at + head + size > len(data):
            if inside:
                raise LogError(f"a record at byte {at} is cut off")
            return
        yield kind, data[at + head:at + head + size]
        at += head + size


def read_log(path, *topics):
    """Yields Logged messages of an MCAP log with Protobuf schemas: all, or those of the topics.

    A log that was cut off (a killed recorder) ends where it ends. Raises LogError for a file that is no log or is damaged."""
    with open(path, "rb") as file:
        data = memoryview(file.read())
    if bytes(data[:len(MAGIC)]) != MAGIC:
        raise LogError(f"{path}: not an MCAP file")
    schemas, channels = {}, {}

    def walk(part, inside):
        for kind, record in _records(part, inside):
            fields = _Fields(record)
            if kind == SCHEMA:
                number = fields.number("H")
                schemas[number] = (fields.text(), fields.text(), bytes(fields.bytes()))
            elif kind == CHANNEL:
                number, schema = fields.number("H"), fields.number("H")
                channels[number] = (fields.text(), schema)
            elif kind == CHUNK:
                fields.number("Q"), fields.number("Q")
                size, _ = fields.number("Q"), fields.number("I")
                yield from walk(_decompress(fields.text(), fields.bytes("Q"), size), True)
            elif kind == MESSAGE:
                topic, schema = channels[fields.number("H")]
                if topics and topic not in topics:
                    continue
                seq, logged, published = fields.number("I"), fields.number("Q"), fields.number("Q")
                name, encoding, descriptors = schemas[schema]
                if encoding != "protobuf":
                    raise LogError(f"{topic}: schema encoding '{encoding}', expected protobuf")
                message = types.classes_of(descriptors)[name].FromString(fields.rest())
                yield Logged(topic, message, logged, published, seq)
            elif kind == DATA_END:
                return

    try:
        yield from walk(data[len(MAGIC):], False)
    except (struct.error, KeyError, UnicodeDecodeError, types.MessageTypeError) as error:
        raise LogError(f"{path}: damaged: {error}") from None
    except LogError as error:
        raise LogError(f"{path}: {error}") from None
