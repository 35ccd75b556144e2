"""Mistakes in launch files: small edits of the shipped ones, and where `mimesis launch --check` must see them."""
import dataclasses


@dataclasses.dataclass
class Mistake:
    name: str
    file: str         # of launch/
    old: str          # first occurrence is replaced ...
    new: str          # ... by this; the mark « stands before the place to be named
    says: str         # part of the message
    suggests: str = None
    options: tuple = ()
    at: str = "mark"  # or "option": the mistake is on the command line; "anywhere": it has several places


IMITATION, BIPED, CROWD, WALK = "imitation.yaml", "biped.yaml", "crowd.yaml", "walk.yaml"

# The 35 of which 24 were found when nodes did not yet describe themselves.
FIRST = [
    Mistake("topic of nobody", IMITATION, "in: {image: camera/image}", "in: {image: «camera/imagge}",
            "no node publishes 'camera/imagge'", "camera/image"),
    Mistake("input left out", IMITATION, "  cognition:\n    exec: mimesis_cognition\n    after: [recorder]\n"
            "    params: {rate_hz: 100}\n    in: {observation: vision/observation, task: planner/status}",
            "  «cognition:\n    exec: mimesis_cognition\n    after: [recorder]\n"
            "    params: {rate_hz: 100}\n    in: {observation: vision/observation}",
            "input 'task' is left out", "planner/status"),
    Mistake("message of another type", IMITATION, "in: {image: camera/image}", "in: {image: «camera/truth}",
            "expected foxglove.RawImage", "camera/image"),
    Mistake("topic of result", IMITATION, "placed: world/outcome.placed", "placed: «world/outcme.placed",
            "no node publishes 'world/outcme'", "world/outcome"),
    Mistake("field of result", IMITATION, "placed: world/outcome.placed", "placed: «world/outcome.plced",
            "has no field 'plced'", "placed"),
    Mistake("bus of drives", IMITATION, 'bus: "embedded:arm"', 'bus: «"embedded:amr"',
            "no other node is on 'embedded:amr'", "embedded:arm"),
    Mistake("port of a known node", IMITATION, "in: {image: camera/image}", "in: {«imge: camera/image}",
            "no input 'imge'", "image"),
    Mistake("absent robot file", IMITATION, "params: {robot: lwr4.yaml}", "params: {robot: «lwr5.yaml}",
            "lwr5.yaml: no such file", "lwr4.yaml"),
    Mistake("robot file of another kind", IMITATION, "params: {robot: lwr4.yaml}", "params: {robot: «biped.yaml}",
            "expected an arm's file", "lwr4.yaml"),
    Mistake("value of a text argument", IMITATION, 'teacher: "${arg:teacher}"', 'teacher: «"${arg:teacher}"',
            "'abve' is neither 'above' nor 'below'", "above", ("--arg", "teacher=precision,abve,high")),
    Mistake("CPU that is not there", IMITATION, "  vision:\n", "  vision:\n    sched: «{cpus: [99]}\n", "no CPU 99"),
    Mistake("program", IMITATION, "exec: mimesis_vision", "exec: «mimesis_visoin", "no program 'mimesis_visoin'",
            "mimesis_vision"),
    Mistake("unknown top key", IMITATION, "clock: ${arg:clock}", "«clok: ${arg:clock}", "unknown key 'clok'", "clock"),
    Mistake("unknown node key", IMITATION, "in: {image: camera/image}\n    required: true",
            "in: {image: camera/image}\n    «requierd: true", "unknown key 'requierd'", "required"),
    Mistake("unknown parameter", IMITATION, "params: {rate_hz: 60}", "params: {«rate: 60}", "unknown parameter", "rate_hz"),
    Mistake("parameter out of range", IMITATION, "params: {rate_hz: 60}", "params: {rate_hz: «60000}", "outside [1, 1000]"),
    Mistake("text for a number", IMITATION, "params: {rate_hz: 60}", "params: {rate_hz: «fast}", "expected a number"),
    Mistake("choice of a parameter", IMITATION, "source: renderer", "source: «rendrer", "expected one of", "renderer"),
    Mistake("after of nobody", IMITATION, "after: [sim_drives, sim_hand]", "after: [sim_drives, «sim_hnd]",
            "no node 'sim_hnd'", "sim_hand"),
    Mistake("circle", IMITATION, "exec: mimesis_planner\n    after: [recorder]", "exec: mimesis_planner\n    after: [«camera]",
            "nodes wait for each other", at="anywhere"),
    Mistake("clock", IMITATION, "clock: ${arg:clock}", "clock: «lokstep", "expected one of wall, sim, lockstep", "lockstep"),
    Mistake("variable", IMITATION, '"${arg:teacher}"', '"«${arg:techer}"', "no argument 'techer'", "teacher"),
    Mistake("type of an argument", CROWD, "figures: {type: int, default: 2,", "figures: {type: int, default: «two,",
            "expected int, found 'two'"),
    Mistake("argument of nobody", WALK, "", "", "no argument 'stile'", "style", ("--arg", "stile=brisk"), "option"),
    Mistake("set of nobody", WALK, "", "", "no node 'synthesiser'", "synthesizer", ("--set", "synthesiser.rate_hz=60"),
            "option"),
    Mistake("set of no parameter", WALK, "", "", "unknown parameter", "rate_hz", ("--set", "synthesizer.rat_hz=60"),
            "option"),
    Mistake("key twice", IMITATION, "params: {rate_hz: 60}", "params: {rate_hz: 60}\n    «params: {rate_hz: 30}",
            "appears twice"),
    Mistake("tab", IMITATION, "  vision:\n    exec", "  vision:\n«\texec", "a tab in the indentation"),
    Mistake("open brace", IMITATION, "in: {image: camera/image}", "in: «{image: camera/image", "never closed"),
    Mistake("time without unit", IMITATION, "ready: {within: 60s}", "ready: {within: «60}", "expected a time such as"),
    Mistake("priority", IMITATION, "  vision:\n", "  vision:\n    sched: {policy: fifo, priority: «100}\n",
            "expected a whole number in [1, 99]"),
    Mistake("signal", IMITATION, "stop: {order: last, timeout: 2s}", "stop: {order: last, signal: «KILL}",
            "expected one of INT, TERM"),
    Mistake("host", IMITATION, "  vision:\n", "  vision:\n    host: «moon\n", "no host 'moon'"),
    Mistake("version", IMITATION, "version: 1", "version: «2", "expected version: 1"),
    Mistake("yes for true", IMITATION, "in: {image: camera/image}\n    required: true",
            "in: {image: camera/image}\n    required: «yes", "expected true or false"),
]
