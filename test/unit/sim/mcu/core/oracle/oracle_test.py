"""Random instructions on our core and in Unicorn: registers, flags, S registers, FPSCR with its cumulative flags and memory have to agree.

usage: oracle_test.py PROGRAM SOURCE_FOLDER [--instructions N] [--seed S] [--only CLASS]
PROGRAM is mcu_oracle_port, which holds our core; Unicorn (GPL-2) is loaded here and linked with nothing of ours. N instructions in all, the
same number for each class; a sequence of them runs from one random state. Exit code 1: a difference; 77: Unicorn is missing.
"""
import argparse
import pathlib
import struct
import subprocess
import sys

import random_instructions

CODE, CODE_BYTES, DATA, DATA_BYTES, WINDOW, WINDOW_BYTES = 0x08000000, 0x200000, 0x20000000, 0x10000, 0x20008000, 1024
SEQUENCE, SLOT = 8, 64
BATCH = 32  # sequences on their way at once: both pipes hold them
# Encodings that are left out because the oracle is wrong about them: (mask, value, bits of FPSCR that must be set for it, reason).
ORACLE_ERRORS = [
    (0xFFBE0F50, 0xEEBA0A40, 3 << 22, "VCVT from fixed point rounds to nearest whatever FPSCR says (DDI 0403, A7.7.229); QEMU takes FPSCR's mode"),
]
STATE = struct.Struct("<15I I I 32I 1024s")
REQUEST, REPLY = struct.Struct("<II64s"), struct.Struct("<II")
FLAGS = 0xF80F0000
FPSCR_CONTROL = {"": 0, "_up": 1 << 22, "_down": 2 << 22, "_zero": 3 << 22, "_fz": 1 << 24, "_dn": 1 << 25, "_fz_dn_up": 0x3400000, "_ahp": 1 << 26}


def load_unicorn(source):
    for folder in sorted(pathlib.Path(source).glob("build/venv/lib/python3*/site-packages")):
        sys.path.insert(0, str(folder))
    try:
        import unicorn
        from unicorn import arm_const
    except ImportError:
        print("skipped: 1 program; unicorn is missing (scripts/requirements-test.txt)")
        sys.exit(77)
    return unicorn, arm_const


class Oracle:
    def __init__(self, source):
        unicorn, arm = load_unicorn(source)
        self.version = ".".join(map(str, unicorn.uc_version()[:2]))
        self.uc = unicorn.Uc(unicorn.UC_ARCH_ARM, unicorn.UC_MODE_THUMB)  # MCLASS would be a Cortex-M33, whatever model is asked for
        self.uc.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M4)
        self.uc.mem_map(CODE, CODE_BYTES)
        self.uc.mem_map(DATA, DATA_BYTES)
        self.arm, self.error = arm, unicorn.UcError
        core = [arm.UC_ARM_REG_R0 + i for i in range(13)] + [arm.UC_ARM_REG_SP, arm.UC_ARM_REG_LR]
        self.registers = core + [arm.UC_ARM_REG_XPSR, arm.UC_ARM_REG_FPSCR] + [arm.UC_ARM_REG_S0 + i for i in range(32)]
        self.uc.reg_write(arm.UC_ARM_REG_CONTROL, 4)

    def execute(self, address, code, state):
        values, window = list(state[:49]), state[49]
        self.uc.mem_write(address, code)
        self.uc.ctl_remove_cache(address, address + SLOT)
        self.uc.mem_write(WINDOW, window)
        self.uc.reg_write_batch(zip(self.registers[:15] + self.registers[16:], values[:15] + values[16:]))
        self.uc.reg_write(self.arm.UC_ARM_REG_XPSR_NZCVQG, values[15] | 1 << 24)
        try:
            self.uc.emu_start(address | 1, address + len(code), 0, 40)
        except self.error as e:
            return None, str(e)
        after = self.uc.reg_read_batch(self.registers)
        return [*after, bytes(self.uc.mem_read(WINDOW, WINDOW_BYTES))], ""


def oracle_error(halfwords, control):
    word = halfwords[0] << 16 | halfwords[-1]
    return len(halfwords) == 2 and any(word & mask == value and control & bits for mask, value, bits, _ in ORACLE_ERRORS)


def make(generator, name, control, left_out):
    code = []
    make_one = getattr(generator, name)
    while True:
        one = make_one()
        if oracle_error(one, control):
            left_out[0] += 1
            continue
        if len(code) + len(one) > 30:
            break
        code += one
        if len(one) <= 2 and len(code) >= SEQUENCE * 2:
            break
    r = [generator.value() for _ in range(15)]
    r[random_instructions.BASE] = WINDOW + 512 + 4 * generator.n(4)
    if name in ("transfer", "t16_transfer") and generator.n(3) == 0:
        r[random_instructions.BASE] += generator.n(4)
    r[random_instructions.INDEX] = generator.n(32)
    r[13] = DATA + 0x7000
    fpscr = control | generator.random.getrandbits(32) & 0xF000009F
    s = [generator.float_bits() for _ in range(32)]
    window = generator.random.getrandbits(8 * WINDOW_BYTES).to_bytes(WINDOW_BYTES, "little")
    return struct.pack(f"<{len(code)}H", *code), (*r, generator.random.getrandbits(32) & FLAGS, fpscr, *s, window)


def differences(ours, oracle):
    if ours[:15] == tuple(oracle[:15]) and ours[16:] == tuple(oracle[16:]) and not (ours[15] ^ oracle[15]) & FLAGS:
        return []
    names = [f"r{i}" for i in range(15)] + ["flags", "fpscr"] + [f"s{i}" for i in range(32)]
    masks = [0xFFFFFFFF] * 15 + [FLAGS] + [0xFFFFFFFF] * 33
    found = [f"{n} {a & k:08x} (oracle {b & k:08x})" for n, a, b, k in zip(names, ours, oracle, masks) if (a ^ b) & k]
    if ours[49] != oracle[49]:
        found.append("memory")
    return found


class Comparison:
    def __init__(self, program, oracle):
        self.port = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.oracle, self.slot = oracle, 0

    def compare(self, cases):
        """For each (code, state) what differs after the sequence, as text; empty where nothing does."""
        addresses = []
        for code, state in cases:
            self.slot = (self.slot + 1) % (CODE_BYTES // SLOT)
            addresses.append(CODE + self.slot * SLOT)
            self.port.stdin.write(REQUEST.pack(addresses[-1], len(code), code.ljust(64, b"\0")) + STATE.pack(*state))
        self.port.stdin.flush()
        return [self.answer(address, code, state) for address, (code, state) in zip(addresses, cases)]

    def answer(self, address, code, state):
        theirs, error = self.oracle.execute(address, code, state)
        cfsr, pc = REPLY.unpack(self.port.stdout.read(REPLY.size))
        ours = STATE.unpack(self.port.stdout.read(STATE.size))
        if cfsr or error:
            return f"fault: ours CFSR {cfsr:#x} at {pc:#x}, oracle {error or 'none'}"
        return ", ".join(differences(ours, theirs))

    def close(self):
        self.port.stdin.close()
        return self.port.wait()


def count(code):
    halfwords = struct.unpack(f"<{len(code) // 2}H", code)
    wide = sum(1 for _ in split(halfwords))
    return wide


def split(halfwords):
    at = 0
    while at < len(halfwords):
        length = 2 if halfwords[at] >> 11 >= 0x1D else 1
        yield halfwords[at:at + length]
        at += length


def narrow(comparison, code, state):
    """The first instruction of a sequence that makes a difference, or all of it where it takes several."""
    halfwords = struct.unpack(f"<{len(code) // 2}H", code)
    prefix = []
    for one in split(halfwords):
        prefix += one
        found = comparison.compare([(struct.pack(f"<{len(prefix)}H", *prefix), state)])[0]
        if found:
            return " ".join(f"{h:04x}" for h in one) + f" after {len(prefix) - len(one)} halfwords: {found}"
    return "only together"


def run(arguments):
    oracle = Oracle(arguments.source)
    comparison = Comparison(arguments.program, oracle)
    classes = [(n, 0, n) for n in random_instructions.INTEGER]
    classes += [(n, bits, n + mode) for n in random_instructions.FLOATING for mode, bits in FPSCR_CONTROL.items()]
    if arguments.only:
        classes = [c for c in classes if c[2] == arguments.only or c[0] == arguments.only]
    share = max(1, arguments.instructions // len(classes))
    total = different = 0
    left_out = [0]
    for index, (name, control, shown) in enumerate(classes):
        generator = random_instructions.Generator(arguments.seed * 1000 + index)
        done = bad = 0
        while done < share:
            cases = [make(generator, name, control, left_out) for _ in range(BATCH)]
            done += sum(count(code) for code, _ in cases)
            for (code, state), found in zip(cases, comparison.compare(cases)):
                bad += found != ""
                if found and bad <= 5:
                    print(f"{shown}: {found}\n    {narrow(comparison, code, state)}")
        print(f"{shown:26} {done:9} instructions, {bad} differences", flush=True)
        total, different = total + done, different + bad
    comparison.close()
    print(f"{total} random instructions in {len(classes)} classes against Unicorn {oracle.version}: {different} differences; "
          f"{left_out[0]} left out as errors of the oracle")
    for _, value, _, reason in ORACLE_ERRORS:
        print(f"    {value:08x}: {reason}")
    return 1 if different or total < arguments.instructions * 0.9 else 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("source")
    parser.add_argument("--instructions", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only")
    sys.exit(run(parser.parse_args()))
