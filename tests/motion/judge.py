#!/usr/bin/python3
"""Judges the motion of figures from recorded logs, as a body with knees, soles and weight would have to move.

    tests/motion/judge.py MODEL.motion.json LOG.mcap ... [--recordings FOLDER] [--json FILE]

Shares no code with the synthesizer: it reads joint angles and the pelvis from the log, lengths and the learned cycles from the
model file, and the clips that the model was learned from (BVH, in FOLDER). Of every character it measures
- the smallest flexion of the knees about their own axis, y of the thigh: below zero a knee bends backward,
- the largest speed of each joint, relative to the same joint (left or right) in the learned cycle of the style,
- the height of the lower end of a foot that rests: slower than 0.1 m/s for 0.1 s it is a foot that stands, and its sole
  is on the ground; and how far any point of a sole is below the ground,
- the largest acceleration of the pelvis at 30 Hz: second difference of its place every 1/30 s,
- the slide of the toes: their mean speed while they are less than 2.5 cm above the ground, weighted by 2 - 2^(h/2.5 cm).
"""
import argparse
import cmath
import json
import math
import pathlib
import statistics
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "python"))
import mimesis.log  # noqa: E402

JOINTS = ("root", "lhip", "lknee", "lank", "rhip", "rknee", "rank", "spine", "chest", "neck", "head", "lsho", "lelb", "lwri",
          "rsho", "relb", "rwri")
LEGS = (("left", "lhip", "lknee", "lank"), ("right", "rhip", "rknee", "rank"))
GRAPH_HZ = 30.0  # rate at which accelerations are compared
REST_M_S, REST_S = 0.1, 0.1
SKATE_M, MOVES_M_S = 0.025, 0.1
GOALS = {"flexion_deg": -2.0, "speed_ratio": 1.3, "sole_mm": 2.0, "acceleration_ratio": 1.3, "slide_ratio": 1.0}


# ---- rotations and vectors: tuples of columns and of three numbers

def rotation(w):
    """Matrix, by rows, of an axis-angle vector (Rodrigues)."""
    x, y, z = w
    u = x * x + y * y + z * z
    angle = math.sqrt(u)
    a, b = (math.sin(angle) / angle, (1.0 - math.cos(angle)) / u) if angle > 1e-9 else (1.0, 0.5)
    return ((1.0 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y),
            (b * x * y + a * z, 1.0 - b * (x * x + z * z), b * y * z - a * x),
            (b * x * z - a * y, b * y * z + a * x, 1.0 - b * (x * x + y * y)))


def times(m, n):
    (a, b, c), (d, e, f), (g, h, i) = n
    return tuple((x * a + y * d + z * g, x * b + y * e + z * h, x * c + y * f + z * i) for x, y, z in m)


def turned(m, v):
    x, y, z = v
    return tuple(r[0] * x + r[1] * y + r[2] * z for r in m)


def plus(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def quaternion(w):
    angle = math.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    s = math.sin(0.5 * angle) / angle if angle > 1e-9 else 0.5
    return math.cos(0.5 * angle), s * w[0], s * w[1], s * w[2]


def between_rad(p, q):
    """Angle between two orientations, exact for small ones too."""
    a, b, c, d = p
    e, f, g, h = q
    x, y, z = a * f - b * e - c * h + d * g, a * g + b * h - c * e - d * f, a * h - b * g + c * f - d * e
    return 2.0 * math.atan2(math.sqrt(x * x + y * y + z * z), abs(a * e + b * f + c * g + d * h))


def flexion_rad(knee, shank):
    """How far the shank has turned about the knee's axis, y of the thigh; > 0: the heel goes to the seat."""
    x, _, z = turned(rotation(knee), shank)
    return math.atan2(-x, -z) - math.atan2(-shank[0], -shank[2])


# ---- the model file

class Model:
    def __init__(self, path):
        data = json.loads(pathlib.Path(path).read_text())
        self.rows, body = data["rows"], data["body"]
        self.offset, self.heel, self.toe = body["offset_m"], body["heel_m"], body["toe_m"]
        self.column = [[self.rows.index(f"{joint}.{axis}") for axis in "xyz"] for joint in JOINTS]
        self.patterns = data["patterns"]
        self._sources = data["sources"]
        self._tied = data.get("delay_rad")

    def vectors(self, values):
        return [tuple(values[c] for c in columns) for columns in self.column]

    def cycle(self, pattern, samples=800):
        """Joint vectors of a learned cycle: the mixture, its sources by their Fourier series."""
        t = len(self._sources[0])
        harmonics = range(1, (t - 1) // 2 + 1)
        series = [[2.0 / t * sum(s * cmath.exp(-2j * math.pi * h * n / t) for n, s in enumerate(source)) for h in harmonics]
                  for source in self._sources]
        mean = [sum(source) / t for source in self._sources]
        delay, weight = pattern.get("delay_rad", self._tied), pattern["weight_rad"]
        turn = [[cmath.exp(2j * math.pi * h * n / samples) for h in harmonics] for n in range(samples)]
        rows = []
        for r in range(len(self.rows)):
            factor = [sum(w * s[h - 1] * cmath.exp(-1j * h * d) for w, d, s in zip(weight[r], delay[r], series))
                      for h in harmonics]
            level = pattern["mean_rad"][r] + sum(w * m for w, m in zip(weight[r], mean))
            rows.append([level + sum((f * e).real for f, e in zip(factor, turn[n])) for n in range(samples)])
        return [self.vectors([row[n] for row in rows]) for n in range(samples)]

    def learned(self, style):
        """Largest speed of each joint in the cycles of a style [rad/s], and the least flexion [deg]."""
        speed, flexion = [0.0] * len(JOINTS), math.inf
        for pattern in self.patterns:
            if pattern["style"] != style:
                continue
            cycle = self.cycle(pattern)
            step_s = pattern["duration_s"] / len(cycle)
            turns = [[quaternion(w) for w in frame] for frame in cycle]
            for n, now in enumerate(turns):
                for j, q in enumerate(now):
                    speed[j] = max(speed[j], between_rad(turns[n - 1][j], q) / step_s)
            flexion = min(flexion, min(self.flexions(frame) for frame in cycle))
        # what one leg or arm may, the other may
        names = list(JOINTS)
        for j, name in enumerate(names):
            other = {"l": "r", "r": "l"}.get(name[0], "") + name[1:]
            if name != "root" and other in names:
                speed[j] = max(speed[j], speed[names.index(other)])
        return speed, flexion

    def flexions(self, vectors):
        return math.degrees(min(flexion_rad(vectors[JOINTS.index(knee)], self.offset[ankle]) for _, _, knee, ankle in LEGS))

    def soles(self, pelvis, heading, vectors):
        """Heel and toe of both feet in the world: left heel, left toe, right heel, right toe."""
        root = times(rotation((0.0, 0.0, heading)), rotation(vectors[0]))
        points = []
        for side, *chain in LEGS:
            turn, place = root, pelvis
            for joint in chain:
                place = plus(place, turned(turn, self.offset[joint]))
                turn = times(turn, rotation(vectors[JOINTS.index(joint)]))
            points += [plus(place, turned(turn, self.heel[side])), plus(place, turned(turn, self.toe[side]))]
        return points


# ---- measures of paths

def resampled(times_s, points, rate_hz):
    """Places at a lower rate, straight between the samples."""
    found, k = [], 0
    for n in range(int((times_s[-1] - times_s[0]) * rate_hz) + 1):
        t = times_s[0] + n / rate_hz
        while k + 2 < len(times_s) and times_s[k + 1] < t:
            k += 1
        u = (t - times_s[k]) / (times_s[k + 1] - times_s[k])
        found.append(tuple(a + u * (b - a) for a, b in zip(points[k], points[k + 1])))
    return found


def accelerations(points, rate_hz):
    return [rate_hz ** 2 * math.sqrt(sum((a - 2.0 * b + c) ** 2 for a, b, c in zip(p, q, r)))
            for p, q, r in zip(points, points[1:], points[2:])]


def slide_m_s(times_s, pelvis, toes):
    """Weighted mean speed of low toes while the pelvis moves; `toes`: paths, heights above the ground."""
    path = weight = 0.0
    for toe in toes:
        for k in range(1, len(toe)):
            h = max(0.0, toe[k][2])
            if h >= SKATE_M or math.dist(pelvis[k], pelvis[k - 1]) < MOVES_M_S * (times_s[k] - times_s[k - 1]):
                continue
            share, step_s = 2.0 - 2.0 ** (h / SKATE_M), times_s[k] - times_s[k - 1]
            path += share * math.hypot(toe[k][0] - toe[k - 1][0], toe[k][1] - toe[k - 1][1])
            weight += share * step_s
    return path / weight if weight > 0.0 else 0.0


def resting(times_s, feet):
    """Indices of the frames in which a foot's lower end has rested, and rests on, for REST_S in all."""
    speed = [math.inf]
    for k in range(1, len(times_s)):
        step_s = times_s[k] - times_s[k - 1]
        low = 0 if feet[k][0][2] <= feet[k][1][2] else 1
        speed.append(math.dist(feet[k][low], feet[k - 1][low]) / step_s)
    found, first = [], None
    for k in range(len(times_s) + 1):
        if k < len(times_s) and speed[k] < REST_M_S:
            first = k if first is None else first
        elif first is not None:
            if times_s[k - 1] - times_s[first] >= REST_S:
                found += range(first, k)
            first = None
    return found


# ---- recordings: BVH, y up, z forward, the units of the Graphics Lab at Carnegie Mellon

class Recording:
    UNIT_M = 0.0254 / 0.45

    def __init__(self, path):
        words = iter(pathlib.Path(path).read_text().split())
        self._joints, stack, order = [], [], 0  # (name, parent, offset, channels, first channel)
        for word in words:
            if word in ("ROOT", "JOINT", "End"):
                self._joints.append([next(words), stack[-1] if stack else -1, None, [], order])
                latest = len(self._joints) - 1
            elif word == "{":
                stack.append(latest)
            elif word == "}":
                stack.pop()
            elif word == "OFFSET":
                self._joints[stack[-1]][2] = tuple(float(next(words)) for _ in range(3))
            elif word == "CHANNELS":
                count = int(next(words))
                self._joints[stack[-1]][3:] = [[next(words) for _ in range(count)], order]
                order += count
            elif word == "Frames:":
                frames = int(next(words))
                next(words), next(words)
                self.rate_hz = round(1.0 / float(next(words)), 3)
                break
        numbers = [float(word) for word in words]
        self._frames = [numbers[n * order:(n + 1) * order] for n in range(frames)]
        self.pelvis, self.toes = [], [[], []]
        for frame in self._frames:
            place = self._places(frame)
            self.pelvis.append(place["Hips"])
            self.toes[0].append(place["LeftToeBase"])
            self.toes[1].append(place["RightToeBase"])
        for side, path in enumerate(self.toes):  # the ground below a toe: its lowest places
            ground = sorted(p[2] for p in path)[len(path) // 20]
            self.toes[side] = [(x, y, z - ground) for x, y, z in path]
        self.times = [n / self.rate_hz for n in range(len(self._frames))]

    def _places(self, frame):
        turns, places, named = [], [], {}
        for name, parent, offset, channels, first in self._joints:
            turn, move = ((1, 0, 0), (0, 1, 0), (0, 0, 1)), offset
            for c, channel in enumerate(channels):
                value, axis = frame[first + c], "XYZ".index(channel[0])
                if channel.endswith("position"):
                    move = tuple(value if a == axis else m for a, m in enumerate(move))
                else:
                    turn = times(turn, rotation([math.radians(value) if a == axis else 0.0 for a in range(3)]))
            place = move if parent < 0 else plus(places[parent], turned(turns[parent], move))
            places.append(place)
            turns.append(turn if parent < 0 else times(turns[parent], turn))
            named.setdefault(name, tuple(self.UNIT_M * place[a] for a in (2, 0, 1)))
        return named

    def measured(self, first, last):
        """Of the frames that were learned: at the ends of a clip markers are lost."""
        frames = slice(first, last + 1)
        found = accelerations(resampled(self.times[frames], self.pelvis[frames], GRAPH_HZ), GRAPH_HZ)
        return {"acceleration_m_s2": max(found), "slide_m_s": slide_m_s(self.times[frames], self.pelvis[frames],
                                       [toe[frames] for toe in self.toes])}


# ---- logs

class Course:
    """What one character did."""

    def __init__(self):
        self.times, self.pelvis, self.heading, self.vectors = [], [], [], []

    def add(self, t, pelvis, heading, vectors):
        self.times.append(t)
        self.pelvis.append(pelvis)
        self.heading.append(heading)
        self.vectors.append(vectors)


def courses(model, log, node="synthesizer"):
    """(style, characters) of a log."""
    found, style = {}, ""
    for logged in mimesis.log.read_log(log, f"{node}/motion", f"{node}/characters", f"{node}/rows"):
        m = logged.message
        if logged.topic.endswith("rows"):
            if list(m.rows) != model.rows:
                raise SystemExit(f"{log}: the rows are not those of the model")
            continue
        t = 1e-9 * m.header.stamp_ns
        if logged.topic.endswith("motion"):
            p, style = m.position_pelvis_in_world_m, m.style
            found.setdefault(0, Course()).add(t, (p.x_m, p.y_m, p.z_m), m.heading_rad, model.vectors(m.position_rad))
            continue
        place, rows, count = m.position_pelvis_in_world_m, m.position_rad, len(model.rows)
        for i, heading in enumerate(m.heading_rad):
            found.setdefault(i, Course()).add(t, tuple(place[3 * i:3 * i + 3]), heading,
                                              model.vectors(rows[count * i:count * (i + 1)]))
    return style, list(found.values())


def judged(model, course):
    """Figures of one character."""
    t, names = course.times, list(JOINTS)
    speed, worst = [0.0] * len(JOINTS), {}
    turns = [[quaternion(w) for w in frame] for frame in course.vectors]
    for k in range(1, len(t)):
        for j, q in enumerate(turns[k]):
            speed[j] = max(speed[j], between_rad(turns[k - 1][j], q) / (t[k] - t[k - 1]))
    flexions = [model.flexions(v) for v in course.vectors]
    soles = [model.soles(p, h, v) for p, h, v in zip(course.pelvis, course.heading, course.vectors)]
    float_m = 0.0
    for side in range(2):
        feet = [points[2 * side:2 * side + 2] for points in soles]
        float_m = max([float_m] + [abs(min(feet[k][0][2], feet[k][1][2])) for k in resting(t, feet)])
    worst["flexion_deg"] = min(flexions)
    worst["backward_s"] = sum(b - a for a, b, f in zip(t, t[1:], flexions) if f < -5.0)
    worst["speed_rad_s"] = speed
    worst["knee_rad_s"] = max(speed[names.index("lknee")], speed[names.index("rknee")])
    worst["sole_mm"] = 1e3 * float_m
    worst["below_mm"] = -1e3 * min(0.0, min(p[2] for points in soles for p in points))
    worst["acceleration_m_s2"] = max(accelerations(resampled(t, course.pelvis, GRAPH_HZ), GRAPH_HZ), default=0.0)
    worst["slide_m_s"] = slide_m_s(t, course.pelvis, [[points[f] for points in soles] for f in (1, 3)])
    return worst


def judge(model, style, found, recording):
    """Figures of all characters of a style beside what was learned and recorded; `missed` counts characters by goal."""
    learned, least = model.learned(style)
    ratio = [max(f["speed_rad_s"][j] / learned[j] for j in range(len(JOINTS))) for f in found]
    fastest = max(found, key=lambda f: max(f["speed_rad_s"][j] / learned[j] for j in range(len(JOINTS))))
    joint = max(range(len(JOINTS)), key=lambda j: fastest["speed_rad_s"][j] / learned[j])
    result = {
        "style": style, "characters": len(found),
        "learned": {"flexion_deg": least, "knee_rad_s": max(learned[2], learned[5])}, "recorded": recording,
        "flexion_deg": min(f["flexion_deg"] for f in found),
        "backward": sum(f["backward_s"] > 0.0 for f in found),
        "backward_s": max(f["backward_s"] for f in found),
        "knee_rad_s": max(f["knee_rad_s"] for f in found),
        "speed_ratio": max(ratio), "fastest_joint": JOINTS[joint],
        "sole_mm": max(max(f["sole_mm"], f["below_mm"]) for f in found),
        "below_mm": max(f["below_mm"] for f in found),
        "acceleration_m_s2": max(f["acceleration_m_s2"] for f in found),
        "acceleration_median_m_s2": statistics.median(f["acceleration_m_s2"] for f in found),
        "slide_m_s": max(f["slide_m_s"] for f in found),
        "slide_median_m_s": statistics.median(f["slide_m_s"] for f in found),
    }
    missed = {
        "flexion_deg": sum(f["flexion_deg"] < GOALS["flexion_deg"] for f in found),
        "speed_ratio": sum(r > GOALS["speed_ratio"] for r in ratio),
        "sole_mm": sum(max(f["sole_mm"], f["below_mm"]) > GOALS["sole_mm"] for f in found),
    }
    if recording:
        for key, name in (("acceleration_ratio", "acceleration_m_s2"), ("slide_ratio", "slide_m_s")):
            result[key] = result[name] / recording[name]
            missed[key] = sum(f[name] > GOALS[key] * recording[name] for f in found)
    result["missed"] = missed
    return result


def recorded(model, style, folder):
    """The largest of the learned cycles of a style, or nothing if a clip is not there."""
    found = []
    for pattern in model.patterns:
        if pattern["style"] != style:
            continue
        paths = sorted(pathlib.Path(folder).rglob(pattern["clip"])) if folder else []
        if not paths:
            return None
        found.append(Recording(paths[0]).measured(pattern["first_frame"], pattern["last_frame"]))
    return {key: max(f[key] for f in found) for key in found[0]}


def told(r):
    recording = r["recorded"]
    beside = lambda key, form: f" (recorded {recording[key]:{form}})" if recording else ""
    return (f"{r['style']}, {r['characters']} characters: least flexion {r['flexion_deg']:.1f} deg (learned "
            f"{r['learned']['flexion_deg']:.1f}), {r['backward']} bend backward by more than 5 deg, up to "
            f"{1e3 * r['backward_s']:.0f} ms; knees {r['knee_rad_s']:.1f} rad/s (learned {r['learned']['knee_rad_s']:.1f}); "
            f"{r['fastest_joint']} {r['speed_ratio']:.2f} times as fast as learned; soles {r['sole_mm']:.1f} mm from the "
            f"ground, {r['below_mm']:.1f} mm below it; pelvis {r['acceleration_m_s2']:.1f} m/s2, median "
            f"{r['acceleration_median_m_s2']:.1f}{beside('acceleration_m_s2', '.1f')}; toes slide at "
            f"{100 * r['slide_m_s']:.1f} cm/s, median {100 * r['slide_median_m_s']:.1f}"
            + (f" (recorded {100 * recording['slide_m_s']:.1f})" if recording else "")
            + "; missed: " + (", ".join(f"{k} by {n}" for k, n in r["missed"].items() if n) or "none"))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model")
    parser.add_argument("logs", nargs="+")
    parser.add_argument("--recordings", help="folder with the clips that the model was learned from")
    parser.add_argument("--style", help="of logs of many characters, which do not say it")
    parser.add_argument("--json", help="write all figures to this file")
    options = parser.parse_args()
    model, styles = Model(options.model), {}
    for log in options.logs:
        style, found = courses(model, log)
        styles.setdefault(options.style or style, []).extend(judged(model, course) for course in found)
    results = [judge(model, style, found, recorded(model, style, options.recordings)) for style, found in styles.items()]
    for result in results:
        print(told(result))
    if options.json:
        pathlib.Path(options.json).write_text(json.dumps(results, indent=1))
    return 1 if any(any(r["missed"].values()) for r in results) else 0


if __name__ == "__main__":
    sys.exit(main())
