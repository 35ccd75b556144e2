"""Greets somebody, and takes another name while it runs."""
import mimesis

with mimesis.Graph("greeter") as graph:
    name = graph.parameter("name", "world", meaning="whom it greets")
    marks = graph.parameter("marks", 1, least=0, most=5, meaning="exclamation marks")
    said = graph.publish("greeter/said", "foxglove.Log")
    for _ in graph.every(0.5):
        said.send(said.message(message=f"hello {name.value}{'!' * marks.value}"))
