"""Speaks the protocol of a page with a viewer-bridge: receives frames, grabs a particle and moves it.

usage: page.py PORT PARTICLE FRAMES

It needs nothing but Python, and follows viewer-bridge/PROTOCOL.md.
"""

import base64
import json
import os
import socket
import struct
import sys

SCENE, FRAME = 1, 2
TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10


class Page:
    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=30)
        self.file = self.socket.makefile("rb")
        key = base64.b64encode(os.urandom(16)).decode()
        host = f"127.0.0.1:{port}"
        self.socket.sendall(
            f"GET /socket HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nConnection: Upgrade\r\n"
            f"Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n\r\n".encode()
        )
        status = self.file.readline()
        assert b" 101 " in status, status
        while self.file.readline() != b"\r\n":
            pass
        self.say(type="hello", protocol=2)

    def say(self, **message):
        self.send(TEXT, json.dumps(message).encode())

    def send(self, kind, payload):
        size = len(payload)
        length = bytes([0x80 | size]) if size < 126 else b"\xfe" + struct.pack(">H", size)
        # A mask of zeros leaves the payload as it is.
        self.socket.sendall(bytes([0x80 | kind]) + length + bytes(4) + payload)

    def next_message(self):
        """The next text as an object, or the next binary message as bytes."""
        while True:
            first, size = self.file.read(2)
            if size == 126:
                (size,) = struct.unpack(">H", self.file.read(2))
            elif size == 127:
                (size,) = struct.unpack(">Q", self.file.read(8))
            payload = self.file.read(size)
            kind = first & 0x0F
            if kind == PING:
                self.send(PONG, payload)
            elif kind == CLOSE:
                sys.exit(f"closed: {payload!r}")
            else:
                return json.loads(payload) if kind == TEXT else payload


def main():
    port, particle, frame_count = map(int, sys.argv[1:])
    page, particle_count, steps, is_answered = Page(port), 0, [], False
    while len(steps) < frame_count or not is_answered:
        message = page.next_message()
        if isinstance(message, dict):
            if message.get("id") == 7:
                assert message["type"] == "outcome" and message["status"] == "applied", message
                is_answered = True
            continue
        (kind,) = struct.unpack_from("<H", message)
        if kind == SCENE:
            (particle_count,) = struct.unpack_from("<I", message, 16)
            page.say(type="grab", id=7, particle=particle, target=[0.5, 0.2, 0.3], over_s=0.1)
        elif kind == FRAME:
            (step,) = struct.unpack_from("<Q", message, 8)
            (count,) = struct.unpack_from("<I", message, 24)
            (number,) = struct.unpack_from("<I", message, 72)
            assert count == particle_count > particle and (not steps or step > steps[-1])
            steps.append(step)
            page.say(type="ack", frame=number)
    page.say(type="release", particle=particle)
    print(f"a page receives {len(steps)} frames, from step {steps[0]} to {steps[-1]}, and grabs a particle")


if __name__ == "__main__":
    main()
