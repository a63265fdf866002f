"""Speed figures against their limits, measured in one run on one core. Called by scripts/bench.

Times vary with the machine, so each figure is the best of a few repetitions, and what gates is the ratio to a limit that
docs/benchmarks.md explains. Exit 6 when a limit is missed."""
import argparse
import json
import os
import subprocess
import sys

BIN = "build/release/bin"


def pinned(command, cwd=None):
    """Runs on one core, with nothing else of ours beside it."""
    if os.path.exists("/usr/bin/taskset"):
        command = ["/usr/bin/taskset", "-c", "0"] + command
    return subprocess.run(command, check=True, capture_output=True, text=True, cwd=cwd).stdout


def google_benchmark(program, name, counter=None, repetitions=5):
    out = json.loads(pinned([program, f"--benchmark_filter=^{name}$", "--benchmark_format=json",
                             f"--benchmark_repetitions={repetitions}", "--benchmark_min_time=0.3"]))
    runs = [b for b in out["benchmarks"] if b.get("run_type") == "iteration"]
    if not runs:
        sys.exit(f"{program}: no benchmark {name}")
    if any(b.get("error_occurred") for b in runs):
        return None  # it says of itself that it cannot run here
    return max(b[counter] for b in runs) if counter else min(b["cpu_time"] for b in runs)


def compare(old):
    """The loop and the BEM rotor model of another revision and of this one, in turn; the best of each."""
    turns, best = 3, {}
    for _ in range(turns):
        for name, folder in (("then", old), ("now", ".")):
            loop = json.loads(pinned([os.path.abspath(f"{folder}/{BIN}/bench_hil"), "scenarios/paper.toml"], cwd=folder))
            bem = json.loads(pinned([f"{folder}/{BIN}/bench_rotor", "--benchmark_filter=^solve/flight_warm_12x16$", "--benchmark_format=json",
                                     "--benchmark_min_time=0.3"]))["benchmarks"][0]["items_per_second"]
            was = best.get(name, (0.0, 0.0))
            best[name] = (max(was[0], loop["times_real_time"]), max(was[1], bem))
    print(f"{os.path.basename(old)} and this tree in turn, best of {turns}:")
    for i, what in enumerate(("whole loop, times real time", "BEM, 12 x 16 nodes, 1/s")):
        then, now = best["then"][i], best["now"][i]
        print(f"        {what:<58} {then:>10.4g} -> {now:>10.4g}   x {now / then:.2f}", flush=True)
    return best


def identification(row):
    """The fit of flights of 20 s at 200 Hz: time against the number of states, memory, and the same problem by Ceres, in turn."""
    fit = lambda solver, flights: json.loads(pinned([f"{BIN}/bench_identify", solver, str(flights)]))
    best = lambda runs: min(runs, key=lambda r: r["cpu_s"])
    pairs = [(fit("own", 3), fit("ceres", 3)) for _ in range(3)]
    own, ceres = best([a for a, _ in pairs]), best([b for _, b in pairs])
    em, large = best([fit("em", 3) for _ in range(2)]), best([fit("own", 25) for _ in range(2)])
    sizes = [own, best([fit("own", 6) for _ in range(2)]), best([fit("own", 12) for _ in range(2)]), large]
    # An iteration costs a sweep; the last one is that of the covariance.
    n, t = [r["states"] for r in sizes], [r["cpu_s"] / (r["iterations"] + 1) for r in sizes]
    mean_n, mean_t = sum(n) / len(n), sum(t) / len(t)
    slope = sum((a - mean_n) * (b - mean_t) for a, b in zip(n, t)) / sum((a - mean_n) ** 2 for a in n)
    print(f"identification, seconds an iteration = {mean_t - slope * mean_n:.3g} + {slope * 1e6:.3g}e-6 x states; measured / fitted: "
          + ", ".join(f"{a}: {b / (mean_t + slope * (a - mean_n)):.3f}" for a, b in zip(n, t)), flush=True)
    apart = max(abs(a - b) / u for a, b, u in zip(own["value"], ceres["value"], own["u"]))
    print(f"        Ceres: {ceres['cpu_s']:.2f} s, {ceres['iterations']} iterations, {ceres['peak_resident_MB']:.0f} MB; "
          f"own {own['cpu_s']:.2f} s, {own['iterations']}, {own['peak_resident_MB']:.0f} MB; estimates within {apart:.1g} standard errors")
    row("fit of 12 000 states, 18 parameters, covariance", own["cpu_s"], "s", 3, True)
    row("the same with the noise unknown", em["cpu_s"], "s", 10, True)
    row("the same by Ceres, times as long", min(b["cpu_s"] for _, b in pairs) / own["cpu_s"], "x", 3, False)
    row("fit of 100 000 states", large["cpu_s"], "s", 30, True)
    row("resident memory of that fit", large["peak_resident_MB"], "MB", 500, True)
    row("time an iteration per state, 100 000 against 12 000", (t[-1] / n[-1]) / (t[0] / n[0]), "x", 1.15, True)
    return {"own": own, "ceres": ceres, "em": em, "sizes": sizes}


def emulated_chip():
    """The program of the ESC on emulated chips with board, drive and bus: speed of four on one core, and instructions of the host for one
    emulated one, counted by callgrind between 0.3 and 0.4 s, when the program has come up. Printed, not judged."""
    elf = "build/firmware/bin/b_g431b_esc1.elf"
    run = lambda seconds, chips: json.loads(pinned([f"{BIN}/bench_mcu_board", elf, str(seconds), str(chips)]))
    four = min((run(1, 4) for _ in range(3)), key=lambda r: r["cpu_s"])
    print(f"      emulated chips: four on one core {four['times_real_time']:.2f} times real time (wanted 1.2), "
          f"{four['million_per_s']:.0f} million instructions a second", flush=True)
    if not os.path.exists("/usr/bin/valgrind"):
        print("skip  callgrind: valgrind is not installed", flush=True)
        return four

    def counted(seconds):
        command = ["/usr/bin/valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", f"{BIN}/bench_mcu_board", elf, str(seconds)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        return int(done.stderr.split("Collected :")[1].split()[0]), json.loads(done.stdout)["instructions"]

    (a, first), (b, second) = counted(0.3), counted(0.4)
    four["host_per_emulated"] = (b - a) / (second - first)
    print(f"      emulated chip: {four['host_per_emulated']:.1f} instructions of the host for one emulated (wanted 24)", flush=True)
    return four


def main():
    p = argparse.ArgumentParser(description=__doc__)
    p.add_argument("--json", help="also write the figures here", default="build/bench/figures.json")
    p.add_argument("--identification", action="store_true", help="these figures alone")
    p.add_argument("--chip", action="store_true", help="the figures of the emulated chip alone")
    p.add_argument("--against", help="folder of another revision, built (scripts/bench --against REV makes it)")
    args = p.parse_args()
    rows = []
    comparison = compare(args.against) if args.against else None

    def row(what, value, unit, limit, lower_is_better):
        ok = value <= limit if lower_is_better else value >= limit
        rows.append({"what": what, "value": value, "unit": unit, "limit": limit, "pass": ok})
        print(f"{'ok  ' if ok else 'MISS'}  {what:<58} {value:>12.4g} {unit:<8} limit {'<=' if lower_is_better else '>='} {limit:g}", flush=True)

    if args.chip:
        emulated_chip()
        return
    if args.identification:
        identification(row)
        sys.exit(0 if all(r["pass"] for r in rows) else 6)

    loop = max((json.loads(pinned([f"{BIN}/bench_hil", "scenarios/paper.toml"])) for _ in range(5)), key=lambda l: l["times_real_time"])
    print(f"whole loop, 24 kHz current loop and 48 kHz PWM, all logs written: {loop['flight']}, {loop['variant']}, {loop['flown_s']:.1f} s flown")
    for name, share in loop["cost_ms_per_s"].items():
        print(f"        {name:<12} {share:7.2f} ms per simulated second")
    row("whole loop, times real time", loop["times_real_time"], "x", 15, False)
    row("resident memory of that flight", loop["peak_resident_MB"], "MB", 200, True)
    row("logs, scaled to a flight of 60 s", loop["log_bytes"] / loop["flown_s"] * 60 / 1e6, "MB", 200, True)
    for kernel, limit in (("baseline", 300e3), ("v3", 500e3), ("v4", 500e3)):
        rate = google_benchmark(f"{BIN}/bench_rotor", f"solve/flight_warm_12x16_{kernel}", "items_per_second")
        if rate is None:
            print(f"skip  BEM, kernel {kernel}: this CPU lacks the instructions", flush=True)
        else:
            row(f"BEM, 12 x 16 nodes, states of a flight, kernel {kernel}", rate, "1/s", limit, False)
    row("BEM, default 22 x 16 nodes, fastest kernel of this CPU", google_benchmark(f"{BIN}/bench_rotor", "solve/flight_warm_22x16", "items_per_second"),
        "1/s", 150e3, False)
    row("mixer", google_benchmark(f"{BIN}/bench_control", "mixer/0") / 1e3, "us", 1.0, True)
    row("one ESC, one 24 kHz period (firmware and drive)", google_benchmark(f"{BIN}/bench_esc", "whole_period"), "ns", 400, True)
    fits = identification(row)
    chip = emulated_chip()
    os.makedirs(os.path.dirname(args.json), exist_ok=True)
    with open(args.json, "w") as f:
        json.dump({"loop": loop, "figures": rows, "identification": fits, "comparison": comparison, "chip": chip}, f, indent=1)
    sys.exit(0 if all(r["pass"] for r in rows) else 6)


if __name__ == "__main__":
    main()
