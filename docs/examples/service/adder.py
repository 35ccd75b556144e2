"""Offers service adder/add: a sum, or the reason why there is none."""
import mimesis

from adder_pb2 import AddAnswer, AddRequest  # protoc --python_out=. adder.proto


def add(request):
    if abs(request.a + request.b) >= 2**63:
        raise mimesis.ServiceError("the sum does not fit into 64 bits")
    return AddAnswer(sum=request.a + request.b)


with mimesis.Graph("adder") as graph:
    graph.offer("add", AddRequest, AddAnswer, add)
    for _ in graph.every(1.0):  # answers meanwhile
        pass
