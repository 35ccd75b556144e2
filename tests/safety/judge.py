"""The judgement of a trial, from what an observer saw: times on the monotonic clock [s], no process, no file."""
import dataclasses
import re

REST_S = 0.3  # the joints are at rest this long after a loss upstream
NAMED_S = 1.2  # a hung node is named: 0.9 s without a sign of life, and the time to look
QUIET_S = 0.1  # this long without motion and power is a stop
CRASHES = {4: "ILL", 6: "ABRT", 7: "BUS", 8: "FPE", 11: "SEGV", 13: "PIPE", 31: "SYS"}
WRECK = re.compile(r"Assertion|assertion|AddressSanitizer|runtime error:|terminate called|Segmentation|"
                   r"killed by (?:signal )?(?:SIG)?(?:SEGV|ABRT|BUS|FPE|ILL|PIPE|SYS)")


@dataclasses.dataclass
class Story:
    """What happened in one trial."""
    victim: str  # a node, "subreaper", "supervisor", or "" if nobody was killed or stopped
    event: float  # when
    samples: list  # of the truth, in order
    still_rad_s: float
    lockstep: bool = False
    upstream: bool = False  # the joints must come to rest
    lost: bool = True  # the run cannot succeed any more
    resumed: float | None = None  # when the victim was continued
    ended: float | None = None  # when the last process had ended; None: it had to be ended by force
    exit_code: int | None = None  # None: the subreaper was killed by us
    errors: list = dataclasses.field(default_factory=list)  # (time, line)
    summary: dict | None = None  # first JSON line
    result: dict | None = None  # last JSON line
    orphans: list = dataclasses.field(default_factory=list)
    leftovers: list = dataclasses.field(default_factory=list)
    log_check: int | None = None  # exit code; None: not looked at
    log_lost_s: float | None = None  # graph time missing at the end of a log whose recorder was lost


@dataclasses.dataclass
class Verdict:
    detected_s: float | None = None
    rest_s: float | None = None
    log_lost_s: float | None = None
    breaches: dict = dataclasses.field(default_factory=dict)  # kind -> what

    def breach(self, kind, what):
        self.breaches.setdefault(kind, what)


def rest_after(story):
    """Time from the event to the last motion before the victim was continued [s]; None without a sample. In lock-step a
    watchdog counts graph time and the launcher wall time: the shorter one is taken."""
    before = [s.graph for s in story.samples if s.at < story.event]
    if not before:
        return None
    moving = [s for s in story.samples if s.at >= story.event and s.speed > story.still_rad_s
              and (story.resumed is None or s.at < story.resumed)]
    if not moving:
        return 0.0
    wall_s = moving[-1].at - story.event
    return min(wall_s, moving[-1].graph - before[-1]) if story.lockstep else wall_s


def moved_after_stop(samples, event, still_rad_s):
    """Time from a stop (without power and motion for QUIET_S) to the motion after it [s]; None: it stayed at rest."""
    quiet = None
    for s in samples:
        if s.at < event:
            continue
        if s.speed > still_rad_s and quiet is not None and s.at - quiet >= QUIET_S:
            return s.at - quiet
        if s.powered or s.speed > still_rad_s:
            quiet = None
        elif quiet is None:
            quiet = s.at
    return None


def names(victim, line):
    """A line of the launcher that tells of the victim; the nodes' own lines begin with [NODE]."""
    if not line.startswith("mimesis: ") or line.startswith("mimesis: logs in"):
        return False
    if victim in ("subreaper", "supervisor"):
        return "the launcher" in line or "interrupted" in line
    return re.search(rf"\b{victim}\b", line) is not None


def judge(story):
    v = Verdict(log_lost_s=story.log_lost_s)
    named = [at for at, line in story.errors if at >= story.event and names(story.victim, line)]
    if story.victim:
        found = min(named, default=story.ended)
        v.detected_s = None if found is None else found - story.event
    _judge_end(story, v)
    if story.lost:
        _judge_report(story, v, named)
    v.rest_s = rest_after(story) if story.upstream else None
    if v.rest_s is not None and v.rest_s > REST_S:
        v.breach("rest", f"moved for {v.rest_s:.2f} s, expected {REST_S} s")
    again = moved_after_stop(story.samples, story.event, story.still_rad_s)
    if again is not None:
        v.breach("motion after stop", f"moved again {again:.2f} s after it had stopped")
    return v


def _judge_end(story, v):
    """No crash, no hang, nothing left, whichever way the run ended."""
    nodes = (story.summary or {}).get("nodes", [])
    for node in nodes:
        code = node["exit_code"] - 128
        if code in CRASHES and not node["killed"] and node["name"] != story.victim:
            v.breach("crash", f"{node['name']} ended by SIG{CRASHES[code]}")
        began = any(line.startswith(f"mimesis: {node['name']} is ready") for _, line in story.errors)
        if node["killed"] and node["name"] != story.victim and began:
            v.breach("hang", f"{node['name']} had to be killed")
    for _, line in story.errors:
        if WRECK.search(line) and not names(story.victim or "-", line):
            v.breach("crash", line)
    if story.exit_code is not None and -story.exit_code in CRASHES:
        v.breach("crash", f"the launcher ended by SIG{CRASHES[-story.exit_code]}")
    if story.ended is None:
        v.breach("hang", "the run did not end in time")
    if story.orphans:
        v.breach("orphans", " ".join(story.orphans))
    if story.leftovers:
        v.breach("leftovers", " ".join(story.leftovers))
    if story.log_check not in (None, 0) and story.victim not in ("recorder", "supervisor"):
        v.breach("log", "the log is damaged")
    if story.ended is not None and (story.result is None or story.summary is None):
        v.breach("no JSON line", "expected a summary and a result")


def _judge_report(story, v, named):
    """Who lost a part says so: exit code, reason, and a line with the name."""
    if story.exit_code == 0 or (story.result or {}).get("success"):
        v.breach("silent", "the run succeeded")
    elif story.result is not None and not (story.result.get("reason") or (story.summary or {}).get("reason")):
        v.breach("silent", "the result has no reason")
    elif not named and story.ended is not None:
        v.breach("silent", f"no line names {story.victim}")
