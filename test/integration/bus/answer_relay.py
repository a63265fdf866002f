"""A relay between a Modbus master and an instrument on pseudo-terminals, which notes every answer that the master was given, and when."""
import bisect
import os
import selectors
import struct
import termios
import threading
import time
import tty

REQUEST, ANSWER = 8, 13  # bytes of a request, and of the answer with four registers


class AnswerRelay:
    """Stands between the terminal `instrument` and a new one at the path `master`, until close()."""

    def __init__(self, instrument, master):
        self.instrument = os.open(instrument, os.O_RDWR | os.O_NOCTTY)
        self.ours, self.theirs = os.openpty()  # theirs stays open here: the end of one master is none of the line
        for fd in (self.instrument, self.theirs):
            tty.setraw(fd)
        os.symlink(os.ttyname(self.theirs), master)
        self.answers, self.asked = [], []  # (time, force of the answer), times of requests: s of the monotonic clock
        self.end, self.wake = os.pipe()
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        asked, answer = b"", b""
        with selectors.DefaultSelector() as selector:
            for fd in (self.instrument, self.ours, self.end):
                selector.register(fd, selectors.EVENT_READ)
            while True:
                for key, _ in selector.select():
                    if key.fd == self.end:
                        return
                    data = os.read(key.fd, 4096)
                    os.write(self.ours if key.fd == self.instrument else self.instrument, data)
                    now = time.monotonic()
                    if key.fd == self.ours:
                        asked += data
                        if len(asked) >= REQUEST:
                            self.asked.append(now)
                            asked, answer = b"", b""
                        continue
                    answer += data
                    if len(answer) == ANSWER and self.asked:
                        self.answers.append((now, struct.unpack(">f", answer[3:7])[0]))

    def forget(self):
        """Between two masters, none of which is there: what one left on the line is none of the next one's."""
        termios.tcflush(self.theirs, termios.TCIOFLUSH)
        self.answers, self.asked = [], []

    def given(self, end_s, silence_s):
        """Answers before `end_s`, as (time, force): those that the master took, and those that it refused. After a refusal `late_max_ms` pass
        from the refused request to the next, also where the answer itself came only after the time-out; after an answer that it took it asks at
        once. What it loses afterwards shows no silence.
        """
        taken, refused, asked = [], [], [*(t for t in list(self.asked) if t < end_s), end_s]
        for at, force in list(self.answers):
            if at < end_s:
                k = bisect.bisect_right(asked, at)
                (taken if k > 0 and asked[k] - asked[k - 1] < silence_s else refused).append((at, force))
        return taken, refused

    def close(self):
        os.write(self.wake, b"x")
        self.thread.join()
        for fd in (self.instrument, self.ours, self.theirs, self.end, self.wake):
            os.close(fd)
