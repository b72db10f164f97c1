"""Protocol between chaic and a helper process, version 2.

Requires the standard library only. Copy this file beside your helper, and call `serve` with an object
that has `sensors`, `reset` and `act`:

    chaic eval --helper "exec:python3 my_helper.py"
    chaic helper check "python3 my_helper.py"

docs/subprocess-helpers.md defines all messages.
"""

import array
import json
import os
import struct
import sys
import traceback

PROTOCOL = 2
TYPES = {"u8": "B", "u16": "H", "f32": "f"}


class Images:
    """Images `rgb`, `depth_m` and `ids`: flat arrays in rows from the top, or None.
    With NumPy: `numpy.asarray(images.depth_m).reshape(height, width)`."""

    def __init__(self, heads, body):
        self.rgb = self.depth_m = self.ids = None
        for head in heads:
            values = array.array(TYPES[head["dtype"]])
            values.frombytes(body[head["offset"] : head["offset"] + head["bytes"]])
            if sys.byteorder == "big":
                values.byteswap()
            setattr(self, head["name"], values)


def serve(helper, name):
    """Serves a helper on standard input and output until chaic closes them. `helper` has

    - `sensors`: the requested images, for example
      `{"image_size": 128, "rgb": False, "depth": True, "ids": False}`;
    - `reset(briefing)`: starts an episode;
    - `act(observation, images)`: returns the next action, for example `"move_forward"` or
      `{"pick_up": {"object": {"pixel": {"column": 3, "row": 70}}, "hand": "left"}}`.
    """
    pipe_in, pipe_out = sys.stdin.buffer, os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    # Output of the helper must not mix with the frames.
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    while True:
        lengths = pipe_in.read(8)
        if len(lengths) < 8:
            return
        n_head, n_body = struct.unpack("<II", lengths)
        message = json.loads(pipe_in.read(n_head))
        body = pipe_in.read(n_body)
        kind = message["type"]
        try:
            if kind == "hello":
                answer = {"type": "hello", "protocol": PROTOCOL, "name": name}
            elif kind == "reset":
                helper.reset(message["briefing"])
                answer = {"type": "ready", "sensors": helper.sensors}
            elif kind == "observe":
                action = helper.act(message, Images(message["images"], body))
                answer = {"type": "act", "action": action}
            else:
                return
        except Exception:
            answer = {"type": "failed", "problem": traceback.format_exc(limit=-3)}
        head = json.dumps(answer).encode()
        pipe_out.write(struct.pack("<II", len(head), 0) + head)
        pipe_out.flush()
