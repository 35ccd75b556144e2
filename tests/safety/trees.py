"""Random launch files of nodes and of programs with children of their own; one process of it is killed, whichever it is."""
import contextlib
import os
import pathlib
import random
import signal
import time

import judge
import trial

# A program that goes on when its child is killed; one that will not stop; one whose child leaves its session.
OBEDIENT = "trap 'exit 0' INT TERM; while :; do sleep 1000 & wait $!; done"
SCRIPTS = {"obedient": OBEDIENT, "stubborn": "trap '' INT TERM; while :; do sleep 1000; done",
           "daemon": "setsid sleep 1000 & " + OBEDIENT}
ENDED_S = 12.0  # three groups of a stop get 3 s each


def graph_text(build, rng):
    """A launch file, and its nodes: name -> (required, restarted)."""
    lines, nodes = ["version: 1", "nodes:"], {}
    for number in range(rng.randrange(1, 7)):
        name, kind = f"n{number}", rng.choice(("counter", "counter", *SCRIPTS))
        required, restarted = kind != "stubborn" and rng.random() < 0.4, rng.random() < 0.3
        keys = [f"exec: {build}/test/mimesis_counter"] if kind == "counter" else [
            "exec: sh", "ready: started", f'args: [-c, "{SCRIPTS[kind]}", {name}]']
        keys += ["stop: {timeout: 300ms}"] if kind == "stubborn" else []
        keys += ["required: true"] if required else []
        keys += ["restart: {policy: on-failure, delay: 50ms}"] if restarted else []
        keys += [f"after: [{rng.choice(list(nodes))}]"] if nodes and rng.random() < 0.5 else []
        lines.append(f"  {name}: {{{', '.join(keys)}}}")
        nodes[name] = required, restarted
    return "\n".join(lines) + "\n", nodes


def name_of(pid, run, nodes):
    """Of a process: its node, "subreaper", "supervisor" or "child"."""
    known = {number: name for name, number in run.processes().items()}
    with contextlib.suppress(OSError):
        words = pathlib.Path(f"/proc/{pid}/cmdline").read_text().split("\0")
        if words[0] == "sh":
            return words[-2]
    return known[pid] if known.get(pid) in (*nodes, *trial.NOT_NODES) else "child"


def kill_one(build, seed):
    """One launch, one kill, one end. Returns the kind of victim, the verdict and a note."""
    rng = random.Random(seed)
    text, nodes = graph_text(build, rng)
    verdict = judge.Verdict()
    with trial.Launch(build) as run:
        file = run.folder / "g.yaml"
        file.write_text(text)
        run.start(file)
        run.wait_end(rng.uniform(0.0, 1.5))
        while not (living := sorted(run.processes().values())) and run.process.poll() is None:
            time.sleep(0.002)
        pid = rng.choice(living)
        victim = name_of(pid, run, nodes)
        settled = sum(" is ready" in line or " has started" in line for _, line in run.errors) >= len(nodes)
        event = time.monotonic()
        with contextlib.suppress(ProcessLookupError):  # it has just ended: nothing is killed
            os.kill(pid, signal.SIGKILL)
        run.wait_end(0.5)
        if run.process.poll() is None:
            run.process.send_signal(signal.SIGINT)
        if not run.wait_end(ENDED_S):
            verdict.breach("hang" if run.process.poll() is None else "orphans", " ".join(map(str, run.processes())))
            run.kill_rest()
        else:
            verdict.detected_s = run.ended - event
        code = run.process.wait()
        if run.leftovers():
            verdict.breach("leftovers", " ".join(run.leftovers()))
        summary, _ = run.json_lines()
        judge_code(verdict, victim, code, summary, nodes, settled)
        note = f"{victim} of {len(nodes)} nodes{'' if settled else ', while starting'}, exit code {code}"
        if verdict.breaches:
            note += "\n" + text + "\n".join(line for _, line in run.errors)
    return ("node" if victim in nodes else victim), verdict, note


def judge_code(verdict, victim, code, summary, nodes, settled):
    if victim == "subreaper":
        return verdict.breach("code", str(code)) if code != -signal.SIGKILL else None
    if code == 2 and not settled:  # it was asked what it is, before anything is started
        return None
    if summary is None:
        return verdict.breach("no JSON line", "expected a summary")
    required, restarted = nodes.get(victim, (False, False))
    if victim == "supervisor" or (required and not restarted):
        if code != 1 or not summary.get("reason"):
            verdict.breach("code", f"{code}, expected 1 and a reason; {summary}")
    elif "no node is left" in summary["reason"]:  # it was the last one
        if code != 1:
            verdict.breach("code", f"{code}, expected 1; {summary}")
    elif code != 130 and settled:
        verdict.breach("code", f"{code}, expected 130; {summary}")
    return None
