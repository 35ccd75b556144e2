"""The node in Python: takes images, publishes how bright they are."""
import mimesis

# protoc -I. -I/usr/share/mimesis --python_out=. msg/brightness.proto proto/header.proto
from msg.brightness_pb2 import Brightness

with mimesis.Graph("brightness") as graph:
    mean = graph.publish("brightness/mean", Brightness)
    for received in graph.subscribe("camera/image"):
        data = received.message.data
        mean.send(Brightness(mean=sum(data) / len(data)), stamp_ns=received.stamp_ns)
