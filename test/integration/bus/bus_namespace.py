"""Tests on a multicast bus of their own: they run in a network namespace with loopback alone, so that nothing else is on it and nothing
leaves the machine. Where namespaces are refused the test is skipped (exit code 77, counted by ctest).
"""
import os
import shutil
import subprocess
import sys

SKIPPED = 77
INSIDE = "ROTORLOOP_TEST_NAMESPACE"


def enter():
    """Starts this program again in a namespace, unless it is in one. Returns only inside."""
    if os.environ.get(INSIDE):
        return
    if not shutil.which("unshare") or not shutil.which("ip"):
        print("skipped: 1 program; unshare (util-linux) or ip (iproute2) is missing")
        sys.exit(SKIPPED)
    set_up = "ip link set lo up && ip route add 239.65.82.0/24 dev lo && exec \"$@\""
    as_user = ["unshare", "--net"] if os.geteuid() == 0 else ["unshare", "--user", "--map-root-user", "--net"]
    if subprocess.run([*as_user, "true"], capture_output=True).returncode != 0:
        print("skipped: 1 program; network namespaces are refused here")
        sys.exit(SKIPPED)
    os.environ[INSIDE] = "1"
    os.execvp(as_user[0], [*as_user, "bash", "-c", set_up, "_", sys.executable, *sys.argv])
