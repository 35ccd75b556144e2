#!/usr/bin/env python3
"""A client of a Mimesis graph that uses ZeroMQ and Protobuf alone.

usage: wire_client.py echo TOPIC [COUNT] | wire_client.py call SERVICE [JSON]
"""
import fcntl
import os
import pathlib
import struct
import sys

import zmq
from google.protobuf import descriptor_pb2, descriptor_pool, json_format, message_factory

from proto.runtime_pb2 import NodeInfo  # protoc --python_out=. proto/header.proto proto/runtime.proto

HEADER = struct.Struct("<QqQQQ")  # seq, stamp [ns], type hash, start id of the publisher, tick [ns]
FLOCK = struct.Struct("@hhqqi4x")  # struct flock of 64-bit Linux: type, whence, start, length, pid


def living_nodes(graph):
    """The NodeInfo of every entry whose lock a process holds."""
    for entry in (graph / "nodes").glob("[!.]*"):
        with open(entry.with_name("." + entry.name), "rb") as lock:
            asked = FLOCK.pack(fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0)
            if FLOCK.unpack(fcntl.fcntl(lock, fcntl.F_OFD_GETLK, asked))[0] != fcntl.F_UNLCK:
                yield NodeInfo.FromString(entry.read_bytes())


def message_class(node, name):
    """The class of a message type, from the descriptors in the node's entry."""
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(node.descriptors[name]).file:
        pool.Add(file)
    return message_factory.MessageFactory(pool).GetPrototype(pool.FindMessageTypeByName(name))


def echo(nodes, context, topic, count="1"):
    node, output = next((n, o) for n in nodes for o in n.outputs if o.topic == topic)
    kind = message_class(node, output.type)
    socket = context.socket(zmq.SUB)
    socket.subscribe(topic.encode() + b"\0")
    socket.connect(node.data_endpoints[0])
    for _ in range(int(count)):
        while len(frames := socket.recv_multipart()) != 2:
            pass  # a place in memory, for those who map it
        head, payload = frames
        seq, stamp_ns, type_hash, _, _ = HEADER.unpack(head.partition(b"\0")[2])
        assert type_hash == output.type_hash, f"{topic} changed its type"
        print(seq, stamp_ns, json_format.MessageToJson(kind.FromString(payload), indent=None), flush=True)


def call(nodes, context, service, request="{}"):
    node, offered = next((n, s) for n in nodes for s in n.services if s.service == service)
    question = json_format.Parse(request, message_class(node, offered.request_type)())
    socket = context.socket(zmq.DEALER)
    socket.connect(node.service_endpoints[0])
    socket.send_multipart([b"request1", service.encode(), question.SerializeToString()])  # any 8 bytes name the request
    _, status, body = socket.recv_multipart()
    if status != b"\0":
        sys.exit(body.decode())
    print(json_format.MessageToJson(message_class(node, offered.response_type).FromString(body), indent=None))


verb, *arguments = sys.argv[1:]
graph = pathlib.Path(os.environ["XDG_RUNTIME_DIR"], "mimesis", os.environ.get("MIMESIS_GRAPH", "default"))
zmq_context = zmq.Context()
zmq_context.linger, zmq_context.rcvtimeo = 0, 5000  # ms
{"echo": echo, "call": call}[verb](list(living_nodes(graph)), zmq_context, *arguments)
