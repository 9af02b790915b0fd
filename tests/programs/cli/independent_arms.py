"""Spiral arms with courses of their own, as docs/method.md defines them, for the independent marcher."""

import math

import numpy as np

NODES = np.arange(513) / 512
COMMON = {"begin": 0.0, "end": math.inf, "pitch_variation": 0.0, "segment_length": 0.25,
          "strength_variation": 0.0, "beat_length": 0.15, "width_growth": 0.0, "seed": 1}


def smooth_step(t):
    t = np.clip(t, 0, 1)
    return t * t * (3 - 2 * t)


class Course:
    """Offset, strength and width of one arm, at the radii NODES."""

    def __init__(self, arm, common, number, law, start_offset, spacing, unit):
        """`law` is d theta/d ln r at a radius, `unit(seed, m, j)` the j-th number of purpose m."""
        seed = (arm.get("seed"),) if "seed" in arm else (common["seed"], number)
        self.draw = lambda m, j: unit(seed, m, j)
        self.begin, self.end = (arm.get(k, common[k]) for k in ("begin", "end"))
        self.offset = start_offset + self.wander(arm, common, law, spacing)
        self.strength = arm.get("strength", 1) * self.beats(common)
        self.width = arm.get("width", 1) * (2 * np.maximum(NODES, 0.04))**common["width_growth"]

    def wander(self, arm, common, law, spacing):
        start = max(self.begin, 0.04)
        first = math.ceil(start * 512)
        sign = math.copysign(1, law(0.5))
        pitches, kinks = arm.get("pitch_angles"), arm.get("kinks", [])
        excess, used = np.zeros(513), 0
        end, ratio, away = 0, 1, 0
        for j in range(first, 513):
            r = NODES[j]
            slope = law(r)
            if pitches:
                slope = sign / math.tan(math.radians(pitches[sum(k <= r for k in kinks)]))
            far = abs(away) > 0.12 * spacing
            if r >= end or (far and away * slope * (1 / ratio - 1) > 0):
                end = r + common["segment_length"] * (0.6 + 0.8 * self.draw(1, used + 1))
                change = math.sqrt(3) * common["pitch_variation"] * (2 * self.draw(1, used + 2) - 1)
                used += 2
                ratio = max(1 + (math.copysign(change, away * slope) if far else change), 0.35)
            away += slope * (1 / ratio - 1) / (r * 512)
            excess[j] = slope / ratio - law(r)
        mean = np.array([excess[max(first, j - 8):j + 9].mean() if j >= first else 0
                         for j in range(513)])
        steps = np.zeros(513)
        for j in range(first, 513):
            before = mean[j - 1] if j > first else mean[j]
            steps[j] = 0.5 * (before + mean[j]) * math.log(NODES[j] / max(NODES[j - 1], start))
        return np.cumsum(steps)

    def beats(self, common):
        beat, low, used = np.ones(513), self.begin, 0
        while low <= 1:
            length = common["beat_length"] * (0.6 + 0.8 * self.draw(2, used + 1))
            depth = common["strength_variation"] * (0.4 + 0.6 * self.draw(2, used + 2))
            used += 2
            inside = (NODES >= low) & (NODES < low + length)
            phase = 2 * np.pi * (NODES - low) / length
            beat = np.where(inside, 1 - depth * (1 - np.cos(phase)) / 2, beat)
            low += length
        rise = smooth_step((NODES - self.begin) / 0.08) if self.begin else 1
        return beat * rise * smooth_step((self.end - NODES) / 0.2)

    def at(self, r):
        """Offset, strength and width; 1/width is linear between nodes."""
        inverse = np.interp(r, NODES, 1 / self.width)
        return np.interp(r, NODES, self.offset), np.interp(r, NODES, self.strength), 1 / inverse


class Courses:
    """All arms of a galaxy whose arms have courses; of() returns None for other galaxies."""

    @staticmethod
    def of(table, arms, law, hash_words, to_unit):
        if not arms and not any(k in table for k in COMMON):
            return None
        return Courses(table, arms, law, hash_words, to_unit)

    def __init__(self, table, arms, law, hash_words, to_unit):
        common = {**COMMON, **{k: table[k] for k in COMMON if k in table}}
        arms = arms or [{}] * table.get("count", 2)
        self.trunks = sum("leaves" not in a for a in arms)
        spacing = 2 * math.pi / self.trunks

        def unit(seed, m, j):
            word = seed[0] if len(seed) == 1 else hash_words(*seed)
            return to_unit(hash_words(word, m, j))

        self.arms, self.straight, trunk = [], [], 0
        for number, arm in enumerate(arms, 1):
            if "leaves" in arm:
                begin = arm.get("begin", common["begin"])
                offset = self.arms[arm["leaves"] - 1].at(begin)[0]
            else:
                offset = math.radians(arm["offset"]) if "offset" in arm else trunk * spacing
                trunk += 1
            course = Course(arm, common, number, law, offset, spacing, unit)
            self.arms.append(course)
            if "leaves" not in arm:
                self.straight.append(course)

    def factor(self, r, angle, arm_width):
        """The arm factor F at the azimuth `angle`, counted from the pattern's winding."""
        n = self.trunks
        floor = (1 - 1 / max(n, 2))**arm_width
        half = min(2 * np.pi * (1 - 2**(-1 / arm_width)), np.pi / n)
        width = min(half / math.sqrt(8 * math.log(2)), 0.7)
        missed = 1
        for arm in self.arms:
            offset, strength, relative = arm.at(r)
            away = np.remainder(angle - offset + np.pi, 2 * np.pi) - np.pi
            missed = missed * (1 - strength * np.exp(-0.5 * (away / (width * relative))**2))
        return floor + (1 - floor) * (1 - missed)

    def mean_factor(self, r, arm_width):
        """The means of F around circles of radii r."""
        angles = np.arange(720) * np.pi / 360
        return np.array([self.factor(np.full(720, one), angles, arm_width).mean() for one in r])

    def displacement(self, r, angle):
        """The angle by which the points of veins are turned back (D_phi of method.md)."""
        spacing = 2 * np.pi / self.trunks
        weights = sums = 0
        for k, arm in enumerate(self.straight):
            offset = arm.at(r)[0]
            away = np.remainder(angle - offset + np.pi, 2 * np.pi) - np.pi
            moved = np.remainder(offset - k * spacing + np.pi, 2 * np.pi) - np.pi
            weight = np.exp(-4.5 * (away / spacing)**2)
            weights, sums = weights + weight, sums + weight * moved
        return sums / weights
