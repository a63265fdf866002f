"""A page in headless Chromium by its DevTools protocol: a stream of events never ends, so that --dump-dom comes too early or never."""
import base64
import json
import os
import re
import shutil
import socket
import struct
import subprocess

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


class Browser:
    def __init__(self, folder, url, width):
        self.process = subprocess.Popen([CHROMIUM, "--headless=new", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0", f"--window-size={width},1500", f"--user-data-dir={folder}/browser{width}", url],
                                        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env={**os.environ, "HOME": folder})
        for line in self.process.stderr:
            if found := re.search(r"ws://127\.0\.0\.1:(\d+)", line):
                break
        else:
            raise RuntimeError("Chromium did not start")
        self.number, self.port = 0, int(found.group(1))
        self.socket = socket.create_connection(("127.0.0.1", self.port), timeout=60)
        self.stream = self.socket.makefile("rb")
        self._upgrade(found.group(0) + re.search(re.escape(found.group(0)) + r"(\S*)", line).group(1))

    def _upgrade(self, address):
        path = address.split(str(self.port), 1)[1]
        self.socket.sendall((f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{self.port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                             f"Sec-WebSocket-Key: {base64.b64encode(os.urandom(16)).decode()}\r\nSec-WebSocket-Version: 13\r\n\r\n").encode())
        while self.stream.readline() != b"\r\n":
            pass
        pages = [t for t in self.call("Target.getTargets")["targetInfos"] if t["type"] == "page"]
        self.session = self.call("Target.attachToTarget", targetId=pages[0]["targetId"], flatten=True)["sessionId"]

    def call(self, method, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if hasattr(self, "session"):
            message["sessionId"] = self.session
        data = json.dumps(message).encode()
        length = bytes([0x80 | len(data)]) if len(data) < 126 else bytes([0xFE]) + struct.pack(">H", len(data))
        self.socket.sendall(bytes([0x81]) + length + bytes(4) + data)  # masked with zeros
        while True:
            size = self.stream.read(2)[1] & 127
            if size > 125:
                size = struct.unpack(">H" if size == 126 else ">Q", self.stream.read(2 if size == 126 else 8))[0]
            answer = json.loads(self.stream.read(size))
            if answer.get("id") == self.number:
                return answer.get("result", {})

    def evaluate(self, expression):
        return self.call("Runtime.evaluate", expression=expression, awaitPromise=True).get("result", {}).get("value")

    def close(self):
        self.stream.close()
        self.socket.close()
        self.process.kill()
        self.process.wait()
        self.process.stderr.close()
