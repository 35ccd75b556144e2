"""Publishes the negative of every image."""
import mimesis

INVERT = bytes(255 - byte for byte in range(256))

with mimesis.Graph("negative") as graph:
    negative = graph.publish("negative/negative", "foxglove.RawImage")
    for received in graph.subscribe("camera/image"):
        image = negative.message()
        image.MergeFromString(received.message.SerializeToString())
        image.data = image.data.translate(INVERT)
        negative.send(image, stamp_ns=received.stamp_ns)
