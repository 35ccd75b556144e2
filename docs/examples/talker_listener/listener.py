"""Prints every line that it hears."""
import mimesis

with mimesis.Graph("listener") as graph:
    for received in graph.subscribe("talker/said"):
        print(f"I heard '{received.message.message}'", flush=True)
