"""Changes the messages of a recording."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

MAGIC = 8
CHANNEL, MESSAGE, CHUNK = 4, 5, 6


@dataclass
class Message:
    topic: str
    step: int
    log_time: int
    data: bytes


def records(data: bytes, at: int = 0) -> Iterator[tuple[int, int, bytes]]:
    """Yields the place, the opcode and the content of each record."""
    while at + 9 <= len(data):
        opcode, size = struct.unpack_from("<BQ", data, at)
        yield at, opcode, data[at + 9 : at + 9 + size]
        at += 9 + size


def record(opcode: int, content: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(content)) + content


class Editor:
    """The messages of a recording of `recorder simulate --compression none`.

    `write` makes an unfinished recording of them, as a recorder that is killed leaves one.
    """

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()[:-MAGIC]
        chunks = [(at, content) for at, opcode, content in records(data, MAGIC) if opcode == CHUNK]
        self._head = data[: chunks[0][0]]
        self._topics: dict[int, str] = {}
        self.messages: list[Message] = []
        for _, content in chunks:
            (name_size,) = struct.unpack_from("<I", content, 28)
            for _, opcode, body in records(content, 40 + name_size):
                if opcode == CHANNEL:
                    number, _, size = struct.unpack_from("<HHI", body)
                    self._topics[number] = body[8 : 8 + size].decode()
                if opcode == MESSAGE:
                    number, step, log_time = struct.unpack_from("<HIQ", body)
                    message = Message(self._topics[number], step, log_time, body[22:])
                    self.messages.append(message)
        (name_size,) = struct.unpack_from("<I", chunks[0][1], 28)
        first = chunks[0][1][40 + name_size :]
        self._declarations = b"".join(
            record(opcode, body) for _, opcode, body in records(first) if opcode != MESSAGE
        )

    def write(self, path: Path) -> Path:
        numbers = {topic: number for number, topic in self._topics.items()}
        body = self._declarations
        for one in self.messages:
            head = struct.pack("<HIQQ", numbers[one.topic], one.step, one.log_time, one.log_time)
            body += record(MESSAGE, head + one.data)
        times = [one.log_time for one in self.messages]
        head = struct.pack("<QQQI", min(times), max(times), len(body), zlib.crc32(body))
        chunk = head + struct.pack("<IQ", 0, len(body)) + body
        path.write_bytes(self._head + record(CHUNK, chunk))
        return path
