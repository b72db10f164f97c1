"""A helper without map or plans: it walks to the nearest visible target, picks it up, looks for the goal
place, and puts it there.

    chaic eval --helper none --helper "exec:python3 examples/python_helper/helper.py" \
        --exec-grants ids,goal_place --task no_constraint,low_target --n-episodes 4
"""

import math
import random

from chaic_helper import serve

NEAR_M = 1.2  # Maximum distance at which the helper picks up or puts on objects, meters.
BLOCKED_M = 0.6  # The path ahead is blocked if the depth is below this, meters.
SIZE = 64  # Requested image size, pixels; `chaic eval --size` overrides it.


class Walker:
    sensors = {"image_size": SIZE, "rgb": False, "depth": True, "ids": True}

    def reset(self, briefing):
        self.briefing = briefing
        # Runs must be repeatable, so random draws use the seed of the briefing.
        self.random = random.Random(briefing["seed"])
        self.given_up = set()
        self.aimed_at = None
        self.turns_left = 0

    def act(self, observation, images):
        self.size = observation["camera"]["width"]
        last = observation["proprioception"]["last"]
        if last is not None and last[1] != "success":
            # The step was blocked, or the object was out of reach: turn away.
            self.turns_left = self.random.randrange(2, 6)
            if self.aimed_at is not None:
                self.given_up.add(self.aimed_at)
        self.aimed_at = None
        hands = [hand for hand in observation["proprioception"]["hands"] if hand is not None]
        wanted = self.briefing["goal_places" if hands else "possible_targets"]
        found = self.nearest(observation, images, wanted, hands)
        if found is not None and found[0] < NEAR_M:
            _, pixel, entity = found
            self.turns_left = 0
            self.aimed_at = entity
            target = {"pixel": {"column": pixel % self.size, "row": pixel // self.size}}
            if hands:
                return {"put_on": {"place": target, "hand": "right"}}
            return {"pick_up": {"object": target, "hand": "right"}}
        if self.turns_left > 0:
            self.turns_left -= 1
            return "turn_left"
        if self.ahead_m(images) < BLOCKED_M or (found is None and self.random.random() < 0.04):
            self.turns_left = self.random.randrange(1, 9)
            return "turn_left"
        if found is not None:
            off = found[1] % self.size + 0.5 - self.size / 2
            if abs(off) > self.size / 8:
                return "turn_right" if off > 0 else "turn_left"
        return "move_forward"

    def ahead_m(self, images):
        """Returns the smallest depth in the center of the image, meters."""
        size = self.size
        middle = range(size // 2 - size // 16, size // 2 + size // 16)
        return min(images.depth_m[size * row + column] for row in middle for column in middle)

    def nearest(self, observation, images, wanted, hands):
        """Returns distance (meters), pixel and id of the nearest visible object of a wanted class."""
        held = {hand["identity"]["entity"] for hand in hands if hand["identity"]}
        classes = dict(observation["granted"]["classes"])
        ids = {e for e, c in classes.items() if c in wanted and e not in held | self.given_up}
        size = self.size
        focal = size / 2 / math.tan(observation["camera"]["vertical_fov_rad"] / 2)
        best = None
        for pixel, entity in enumerate(images.ids or ()):
            if entity in ids:
                depth = images.depth_m[pixel]
                sideways = depth * (pixel % size + 0.5 - size / 2) / focal
                distance = math.hypot(depth, sideways)
                if best is None or distance < best[0]:
                    best = (distance, pixel, entity)
        return best


if __name__ == "__main__":
    serve(Walker(), "walker")
