"""An instrument on a pseudo-terminal whose every answer has a number of its own, and a witness of what happened in which order.

`stand run` takes an answer in the thread of its instruments and asks again; the thread of the CAN bus takes it over in its next turn, sends a
set-point every 10 ms, and writes what it has at the end of a turn, 10 ms after it last wrote. So the answer before a request is in the files when
SET_POINTS set-points have been seen after that request: the first may be of a turn that had begun before, the second may have written just before
it, the third may follow at once after a turn that was late, the fourth writes at its end, which is over when the fifth comes. How long all this
takes does not matter: a machine under load only has fewer answers that must be there.
"""
import os
import select
import socket
import struct
import termios
import threading
import tty

REQUEST = 8                  # bytes: slave, function, address, count, CRC
FIRST_N, STEP_N = 1.0, 1 / 4096  # forces that single precision holds exactly
SET_POINTS = 5
RPM_COMMAND = 0x0407_7E      # DroneCAN type 1031 of node 126, that of `stand run`


def crc16(data):
    """Of Modbus (MODBUS over Serial Line V1.02, 6.2.2)."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ 0xA001 if crc & 1 else crc >> 1
    return struct.pack("<H", crc)


def number_of(force_N):
    return round((force_N - FIRST_N) / STEP_N)


class NumberedInstrument:
    """Answers at the path `master` with force and torque in two floats each, and listens to the bus of UDP multicast `group`, until close()."""

    def __init__(self, master, group, port):
        self.ours, self.theirs = os.openpty()  # theirs stays open here: the end of one master is none of the line
        tty.setraw(self.theirs)
        os.set_blocking(self.ours, False)
        os.symlink(os.ttyname(self.theirs), master)
        self.bus = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.bus.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.bus.bind((group, port))
        self.bus.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(group) + socket.inet_aton("0.0.0.0"))
        self.bus.setblocking(False)
        self.lock = threading.Lock()
        self.forget()
        self.end, self.wake = os.pipe()
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def forget(self):
        """Between two masters, none of which is there."""
        with self.lock:
            termios.tcflush(self.theirs, termios.TCIOFLUSH)
            self.request = b""
            self.answered = self.set_points = 0
            self.seen = []  # (answers before a request, set-points before it), of requests after which fewer than SET_POINTS have come
            self.safe = 0

    def run(self):
        while True:
            ready, _, _ = select.select([self.ours, self.bus, self.end], [], [])
            if self.end in ready:
                return
            with self.lock:
                if self.ours in ready:
                    self.take()
                self.listen()

    def take(self):
        try:
            self.request += os.read(self.ours, 4096)
        except BlockingIOError:  # forgotten meanwhile
            return
        while len(self.request) >= REQUEST:
            request, self.request = self.request[:REQUEST], self.request[REQUEST:]
            self.listen()  # set-points that were sent before this moment
            self.seen.append((self.answered, self.set_points))
            body = request[:2] + bytes([8]) + struct.pack(">ff", FIRST_N + self.answered * STEP_N, 0.01)
            self.answered += 1
            os.write(self.ours, body + crc16(body))  # in one piece: nothing can come between its bytes

    def listen(self):
        while True:
            try:
                packet = self.bus.recv(2048)
            except BlockingIOError:
                break
            if len(packet) >= 10 and struct.unpack_from("<I", packet, 6)[0] & 0xFFFFFF == RPM_COMMAND:
                self.set_points += 1
        while self.seen and self.set_points - self.seen[0][1] >= SET_POINTS:
            self.safe = self.seen.pop(0)[0]

    def must_be_readable(self):
        """Answers, from the first, that are in the run's files at this moment."""
        with self.lock:
            self.listen()
            return self.safe

    def close(self):
        os.write(self.wake, b"x")
        self.thread.join()
        self.bus.close()
        for fd in (self.ours, self.theirs, self.end, self.wake):
            os.close(fd)
