"""Asks for a sum: client.py A B. Needs no definition of the types: the node announces them."""
import sys

import mimesis

with mimesis.Graph() as graph:
    try:
        print(graph.call("adder/add", {"a": int(sys.argv[1]), "b": int(sys.argv[2])}).sum)
    except mimesis.ServiceError as error:
        sys.exit(error)
