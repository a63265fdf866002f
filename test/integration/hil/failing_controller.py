"""A controller at position level that follows the set-point, until it fails at one step in the way that its argument names."""
import json
import os
import signal
import sys

AT_STEP = 2500  # 0.8 s after it has been given the rotors
MODE = sys.argv[1]
sys.stdin.readline()
print(json.dumps({"rotorloop_controller": 2 if MODE == "version" else 1, "level": "position"}), flush=True)
for line in sys.stdin:
    s = json.loads(line)
    a = {"step": s["step"], "p_W_m": s["setpoint_p_W_m"], "v_W_m_s": s["setpoint_v_W_m_s"], "a_W_m_s2": s["setpoint_a_W_m_s2"],
         "j_W_m_s3": s["setpoint_j_W_m_s3"], "yaw_rad": s["setpoint_yaw_rad"], "yaw_rate_rad_s": s["setpoint_yaw_rate_rad_s"]}
    late = s["step"] - AT_STEP
    if MODE == "hang" and late == 0:
        signal.pause()
    if MODE == "crash" and late == 0:
        os.kill(os.getpid(), signal.SIGSEGV)
    if MODE == "exit" and late == 0:
        sys.exit("out of ideas")
    if MODE == "text" and late == 0:
        print("not an answer", flush=True)
    if MODE == "nan_once" and late == 0 or MODE == "nan_thrice" and 0 <= late < 3:
        a["p_W_m"] = [float("nan")] * 3
    if MODE == "far_once" and late == 0:
        a["p_W_m"] = [1e9, 0.0, 2.0]
    print(json.dumps(a), flush=True)
