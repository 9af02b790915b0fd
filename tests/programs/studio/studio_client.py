"""A client of gstudio on the standard library: HTTP, WebSocket (RFC 6455), and the program itself."""

import base64
import hashlib
import http.client
import json
import os
import re
import secrets
import socket
import struct
import subprocess

GUID = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"
TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10


class Closed(Exception):
    """The server has closed the connection."""


class WebSocket:
    """A WebSocket that sends any bytes, even those that no browser sends."""

    def __init__(self, port, fields, timeout=60):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=timeout)
        key = base64.b64encode(secrets.token_bytes(16)).decode()
        lines = ["GET /ws HTTP/1.1", "Upgrade: websocket", "Connection: Upgrade",
                 f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13",
                 *(f"{name}: {value}" for name, value in fields)]
        self.socket.sendall("\r\n".join([*lines, "", ""]).encode())
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            byte = self.socket.recv(1)
            if not byte:
                raise Closed("no answer")
            head += byte
        self.status = int(head.split()[1])
        self.asked = 1000000  # numbers of messages that ask() sends
        if self.status == 101:
            accept = base64.b64encode(hashlib.sha1((key + GUID).encode()).digest())
            assert accept in head, head

    def send_bytes(self, kind, payload):
        head = bytes([0x80 | kind])
        if len(payload) < 126:
            head += bytes([0x80 | len(payload)])
        elif len(payload) < 1 << 16:
            head += bytes([0x80 | 126]) + struct.pack(">H", len(payload))
        else:
            head += bytes([0x80 | 127]) + struct.pack(">Q", len(payload))
        mask = secrets.token_bytes(4)
        whole = int.from_bytes((mask * (len(payload) // 4 + 1))[: len(payload)], "big")
        masked = (int.from_bytes(payload, "big") ^ whole).to_bytes(len(payload), "big")
        self.socket.sendall(head + mask + masked)

    def exactly(self, count):
        parts = []
        while count > 0:
            part = self.socket.recv(min(count, 1 << 20))
            if not part:
                raise Closed("the connection has ended")
            parts.append(part)
            count -= len(part)
        return b"".join(parts)

    def receive_bytes(self):
        """The next message: its kind and bytes."""
        while True:
            first, second = self.exactly(2)
            size = second & 0x7F
            if size == 126:
                (size,) = struct.unpack(">H", self.exactly(2))
            elif size == 127:
                (size,) = struct.unpack(">Q", self.exactly(8))
            payload = self.exactly(size)
            kind = first & 0x0F
            if kind == PING:
                self.send_bytes(PONG, payload)
            elif kind == CLOSE:
                raise Closed(payload[2:].decode())
            else:
                return kind, payload

    def send(self, message):
        self.send_bytes(TEXT, json.dumps(message).encode())

    def receive(self):
        """The next message: an object, or a frame as (head, values[plane][row][column])."""
        kind, payload = self.receive_bytes()
        return json.loads(payload) if kind == TEXT else frame_of(payload)

    def ask(self, op, **members):
        """Sends a message and waits for its answer, a text."""
        self.asked += 1
        number = self.asked
        self.send({"op": op, "id": number, **members})
        while True:
            answer = self.receive()
            if isinstance(answer, dict) and answer.get("id") == number:
                return answer

    def close(self):
        self.socket.close()

    def __del__(self):
        self.close()


def frame_of(payload):
    """The head of a frame and its planes, each a flat list."""
    (length,) = struct.unpack("<I", payload[:4])
    head = json.loads(payload[4 : 4 + length])
    assert length % 4 == 0
    numbers = memoryview(payload[4 + length :]).cast("f")
    pixels = head["width"] * head["rows"]
    assert len(numbers) == pixels * len(head["planes"]), (len(numbers), head)
    return head, [numbers[p * pixels : (p + 1) * pixels] for p in range(len(head["planes"]))]


class Studio:
    """A running gstudio."""

    def __init__(self, program, arguments, folder, environment=None):
        self.process = subprocess.Popen(
            [program, *arguments, "--no-browser"], cwd=folder, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, text=True, env={**os.environ, "GAMER_CACHE": "off", **(environment or {})})
        line = self.process.stdout.readline()
        match = re.search(r"http://127\.0\.0\.1:(\d+)/\?token=([0-9a-f]{32})\b", line)
        if not match:
            error = self.process.stderr.read()
            self.stop()
            raise RuntimeError(f"no address: {line!r} {error!r}")
        self.port, self.token = int(match[1]), match[2]
        self.address = match[0]
        self.cookie = None

    def get(self, target, fields=(), method="GET", host=None):
        """The status, fields and body of the answer to a request."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        connection.putrequest(method, target, skip_host=True, skip_accept_encoding=True)
        if host != "":
            connection.putheader("Host", host or f"127.0.0.1:{self.port}")
        for name, value in fields:
            connection.putheader(name, value)
        connection.endheaders()
        answer = connection.getresponse()
        result = answer.status, dict(answer.getheaders()), answer.read()
        connection.close()
        return result

    def enter(self):
        """Exchanges the token for the cookie."""
        status, fields, _ = self.get(f"/?token={self.token}")
        assert status == 200, status
        self.cookie = fields["Set-Cookie"].split(";")[0]
        return fields["Set-Cookie"]

    def page(self, host=None, origin=None, cookie=None):
        """A WebSocket opened as the page does, or with other fields; "" leaves a field out."""
        host = f"127.0.0.1:{self.port}" if host is None else host
        origin = f"http://{host}" if origin is None else origin
        cookie = self.cookie if cookie is None else cookie
        fields = [("Host", host), ("Origin", origin), ("Cookie", cookie)]
        return WebSocket(self.port, [field for field in fields if field[1]])

    def stop(self):
        self.process.terminate()
        self.process.wait(timeout=10)
        self.process.stdout.close()
        self.process.stderr.close()
