"""Mimesis from Python: publish, subscribe, call services, read logs. Needs python3-zmq and python3-protobuf.

    import mimesis
    with mimesis.Graph("viewer") as graph:
        for received in graph.subscribe("vision/observation", timeout_s=10.0):
            print(received.stamp_ns, received.message)

The graph is the one that MIMESIS_GRAPH names, on this host. Messages are typed by the descriptors that nodes announce;
types of this project are known without a node too (mimesis.message_type). docs/examples has whole nodes.
"""
from .graph import Graph, Received, ServiceError
from .log import LogError, read_log
from .node import Node, run
from .types import MessageTypeError, message_type

__all__ = ["Graph", "LogError", "MessageTypeError", "Node", "Received", "ServiceError", "message_type", "read_log", "run"]
