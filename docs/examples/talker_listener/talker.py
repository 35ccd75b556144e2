"""Publishes a line of text twice a second."""
import mimesis

with mimesis.Graph("talker") as graph:
    said = graph.publish("talker/said", "foxglove.Log")
    for count, _ in enumerate(graph.every(0.5), start=1):
        said.send(said.message(message=f"hello {count}"))
