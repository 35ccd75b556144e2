#!/usr/bin/python3
"""A node for tests: adds up what it hears, what it is told, and its salt."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import mimesis  # noqa: E402


class Summer(mimesis.Node):
    about = "Adds up what it hears (for tests)"
    rate_hz = 50.0

    def create(self):
        self.salt = self.parameter("salt", 0, 0, 1000, "added in each step")
        self.word = self.input("word", "mimesis.v1.Publication", "reliable")
        self.sum = self.output("sum", "mimesis.v1.Publication", latched=True)
        self.beat = self.output("beat", "mimesis.v1.Beat")
        self.service("add", "mimesis.v1.Publication", "mimesis.v1.Publication", self.add)
        self.total = 0

    def add(self, request):
        if request.seq == 13:
            raise mimesis.ServiceError("13 brings bad luck")
        self.total += request.seq
        return {"seq": self.total}

    def stop(self, now_ns):
        print("stopped", file=sys.stderr)

    def step(self, now_ns):
        if self.salt.value == 666:
            raise ValueError("an evil salt")
        self.total += self.salt.value
        while (heard := self.word.pop()) is not None:
            self.total = (self.total * 31 + heard.message.seq) % 2**32
        self.sum.send(self.sum.message(topic="sum", seq=self.total), now_ns)
        self.beat.send(self.beat.message(phase_rad=self.total % 6))


if __name__ == "__main__":
    sys.exit(mimesis.run(Summer))
