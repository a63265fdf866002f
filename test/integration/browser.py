"""A page in headless Chromium, asked over its debugging pipe: file descriptors 3 and 4, JSON messages that end with a zero byte."""
import itertools
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
QUIT_s = 10


class Page:
    def __init__(self, address, width=1280, height=900):
        # The profile is the page's own: processes of the browser may write into it for a moment after the first of them has ended.
        self.profile = tempfile.mkdtemp(prefix="rotorloop-browser-")
        to_browser, self.write = os.pipe()
        self.read, from_browser = os.pipe()
        descriptors = f"exec \"$@\" 3<&{to_browser} 4>&{from_browser}"  # the shell gives them the numbers that Chromium expects
        self.process = subprocess.Popen(["bash", "-c", descriptors, "_", CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
                                         "--remote-debugging-pipe", f"--window-size={width},{height}", f"--user-data-dir={self.profile}", "about:blank"],
                                        pass_fds=(to_browser, from_browser), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
        os.close(to_browser)
        os.close(from_browser)
        self.numbers, self.session, self.received = itertools.count(1), None, b""
        target = next(t for t in self.ask("Target.getTargets")["targetInfos"] if t["type"] == "page")
        self.session = self.ask("Target.attachToTarget", targetId=target["targetId"], flatten=True)["sessionId"]
        self.ask("Page.navigate", url=address)

    def ask(self, method, **parameters):
        number = next(self.numbers)
        message = {"id": number, "method": method, "params": parameters, **({"sessionId": self.session} if self.session else {})}
        os.write(self.write, json.dumps(message).encode() + b"\0")
        while True:
            while b"\0" not in self.received:
                more = os.read(self.read, 65536)
                if not more:
                    raise RuntimeError("the browser has ended")
                self.received += more
            text, self.received = self.received.split(b"\0", 1)
            answer = json.loads(text)
            if answer.get("id") == number:
                return answer.get("result", {})

    def value(self, expression):
        return self.ask("Runtime.evaluate", expression=expression, returnByValue=True).get("result", {}).get("value")

    def wait_for(self, expression, deadline_s):
        """Its value as soon as it is true; None at the deadline. The page looks at each of its frames; a page that is left for another one
        forgets the question, which is asked again."""
        look = f"new Promise(done => {{ const look = () => {{ let v; try {{ v = {expression} }} catch {{}} v ? done(v) : setTimeout(look, 20) }}; look() }})"
        end = time.monotonic() + deadline_s
        while time.monotonic() < end:
            wait_ms = 1000 * max(1, int(end - time.monotonic()))
            late = f"new Promise(done => setTimeout(done, {wait_ms}, null))"
            answer = self.ask("Runtime.evaluate", expression=f"Promise.race([{look}, {late}])", returnByValue=True, awaitPromise=True)
            if value := answer.get("result", {}).get("value"):
                return value
        return None

    def close(self):
        """Asks the browser to end, ends what is left of its processes, and removes its profile."""
        try:
            self.session = None
            self.ask("Browser.close")
            self.process.wait(QUIT_s)
        except (OSError, RuntimeError, subprocess.TimeoutExpired):
            pass
        try:
            os.killpg(self.process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        self.process.wait()
        os.close(self.write)
        os.close(self.read)
        shutil.rmtree(self.profile, ignore_errors=True)
