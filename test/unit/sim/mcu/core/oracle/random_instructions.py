"""Random instructions of an ARMv7E-M core with single-precision FPU, by class. Each generator returns the halfwords of one instruction
that is defined and whose result the architecture fixes: no PC and SP where they are unpredictable, no store outside the window."""
import random

BASE, INDEX = 5, 6  # registers that hold an address in the window, and a small number


class Generator:
    def __init__(self, seed):
        self.random = random.Random(seed)
        draw = self.random.random
        self.n = lambda count: int(draw() * count)  # several times as fast as randrange; no count here comes near 2^53

    def any(self, *choices):
        return choices[self.n(len(choices))]

    def reg(self):
        return self.any(0, 1, 2, 3, 4, 7, 8, 9, 10, 11, 12, 14)  # BASE and INDEX are read by others only

    def source(self):
        return self.n(13)

    def low(self):
        return self.any(0, 1, 2, 3, 4, 7)

    def value(self):
        kind = self.n(8)
        if kind > 4:
            return self.random.getrandbits(32)
        return (self.n(4), 0x80000000 >> self.n(2), 0xFFFFFFFF - self.n(3), 0x7FFFFFFF, self.n(256))[kind]

    def float_bits(self):
        kind, n = self.n(12), self.n
        sign = n(2) << 31
        if kind < 8:
            return sign | ((0, 0x7F800000, 0x7FC00000 | n(1000), 0x7F800001 + n(1000), n(0x800000), (n(4) << 23) | n(0x800000),
                            0x4B000000 + n(0x5000000), 0x3F800000 + n(16))[kind])
        if kind < 10:
            return sign | (90 + n(80)) << 23 | n(0x800000)
        return self.random.getrandbits(32)

    # --- integer ---------------------------------------------------------------------------------------------------------
    def t16_shift_add_move(self):
        op = self.n(8)
        d, m = self.low(), self.n(8)
        if op < 4:
            return [op << 11 | self.n(256) << 6 & 0x7C0 | m << 3 | d] if op < 3 else [0x1800 | self.n(4) << 9 | self.n(8) << 6 | m << 3 | d]
        return [op << 11 | d << 8 | self.n(256)]

    def t16_data(self):
        return [0x4000 | self.n(16) << 6 | self.n(8) << 3 | self.low()]

    def t16_high_extend_reverse(self):
        kind = self.n(3)
        if kind == 0:
            return [0xB200 | self.n(4) << 6 | self.n(8) << 3 | self.low()]
        if kind == 1:
            return [0xBA00 | self.any(0, 1, 3) << 6 | self.n(8) << 3 | self.low()]
        op, d, m = self.n(3), self.reg(), self.source()
        if op == 1 and d < 8 and m < 8:
            op = 2
        return [0x4400 | op << 8 | (d & 8) << 4 | m << 3 | (d & 7)]

    def t16_sp(self):
        return self.any([0xA800 | self.low() << 8 | self.n(256)], [0xA000 | self.low() << 8 | self.n(256)], [0xB000 | self.n(2) << 7 | self.n(16)])

    def data(self, op, s):
        """(Rd, Rn) of a data-processing instruction; compares and moves included."""
        d, n = self.reg(), self.source()
        if s and op in (0, 4, 8, 13) and self.n(3) == 0:
            d = 15
        if op in (2, 3) and self.n(2):
            n = 15
        return d, n

    def t32_shifted(self):
        op, s, kind, imm = self.any(0, 1, 2, 3, 4, 6, 8, 10, 11, 13, 14), self.n(2), self.n(4), self.any(0, self.n(32), self.n(32))
        if op == 6:
            s, kind = 0, kind & 2
        d, n = self.data(op, s) if op != 6 else (self.reg(), self.source())
        return [0xEA00 | op << 5 | s << 4 | n, imm >> 2 << 12 | d << 8 | (imm & 3) << 6 | kind << 4 | self.source()]

    def t32_immediate(self):
        op, s, i, imm3, imm8 = self.any(0, 1, 2, 3, 4, 8, 10, 11, 13, 14), self.n(2), self.n(2), self.n(8), 1 + self.n(255)
        d, n = self.data(op, s)
        return [0xF000 | i << 10 | op << 5 | s << 4 | n, imm3 << 12 | d << 8 | imm8]

    def t32_plain_immediate(self):
        d, n, low, width = self.reg(), self.source(), self.n(32), self.n(32)
        op = self.any(0, 10, 4, 12, 16, 18, 24, 26, 20, 28, 22)
        if op in (0, 10, 4, 12):
            if op in (0, 10) and self.n(4) == 0:
                n = 15
            return [0xF200 | self.n(2) << 10 | op << 4 | n, self.n(8) << 12 | d << 8 | self.n(256)]
        if op in (20, 28):
            low, width = self.n(32), 0
            width = self.n(32 - low)
        if op == 22:
            width = max(width, low)
            n = self.any(n, n, n, 15)
        if op in (18, 26) and low == 0:
            width &= 15
        return [0xF200 | op << 4 | n, low >> 2 << 12 | d << 8 | (low & 3) << 6 | width]

    def t32_register(self):
        d, n, m = self.reg(), self.source(), self.source()
        kind = self.n(5)
        if kind == 0:
            return [0xFA00 | self.n(8) << 4 | n, 0xF000 | d << 8 | m]
        if kind == 1:
            return [0xFA00 | self.n(6) << 4 | self.any(n, 15), 0xF080 | d << 8 | self.n(4) << 4 | m]
        if kind == 2:
            return [0xFA80 | self.any(0, 1, 2, 4, 5, 6) << 4 | n, 0xF000 | d << 8 | self.any(0, 1, 2, 4, 5, 6) << 4 | m]
        if kind == 3:
            return [0xFA80 | n, 0xF080 | d << 8 | self.n(4) << 4 | m]
        return self.any([0xFA90 | m, 0xF080 | d << 8 | self.n(4) << 4 | m], [0xFAA0 | n, 0xF080 | d << 8 | m], [0xFAB0 | m, 0xF080 | d << 8 | m])

    def multiply(self):
        op, a = self.n(8), self.any(self.source(), self.source(), 15)
        which = {0: self.n(2), 1: self.n(4), 7: 0}.get(op, self.n(2))
        if a == 15 and (op == 6 or (op == 0 and which == 1)):
            a = 0
        return [0xFB00 | op << 4 | self.source(), a << 12 | self.reg() << 8 | which << 4 | self.source()]

    def long_multiply_divide(self):
        low = self.reg()
        high = self.any(*[r for r in (0, 1, 2, 3, 4, 7, 8) if r != low])
        op, which = self.any((0, 0), (1, 15), (2, 0), (3, 15), (4, 0), (4, 8), (4, 9), (4, 10), (4, 11), (4, 12), (4, 13), (5, 12), (5, 13), (6, 0), (6, 6))
        return [0xFB80 | op << 4 | self.source(), (15 if which == 15 else low) << 12 | high << 8 | which << 4 | self.source()]

    # --- memory: BASE is a multiple of 4 in the middle of the window -----------------------------------------------------------
    def transfer(self):
        t, op = self.reg(), self.any(0xF800, 0xF810, 0xF820, 0xF830, 0xF840, 0xF850, 0xF910, 0xF930)
        kind = self.n(5)
        if kind == 0:
            return [op | 0x80 | BASE, t << 12 | self.any(0, self.n(0x100), self.n(0x100))]
        if kind == 1:
            return [op | BASE, t << 12 | self.n(4) << 4 | INDEX]
        if kind == 2:
            return [op | BASE, t << 12 | 0xC00 | self.n(256)]
        if kind == 3:
            return [op | BASE, t << 12 | 0xE00 | self.n(64)]  # unprivileged
        return [op | BASE, t << 12 | self.any(0x900, 0xB00, 0xD00, 0xF00) | self.n(9)]

    def t16_transfer(self):
        t, kind = self.low(), self.n(4)
        if kind == 0:
            return [0x5000 | self.n(8) << 9 | INDEX << 6 | BASE << 3 | t]
        return [(12 + self.n(6)) << 11 | self.n(16) << 6 | BASE << 3 | t]

    def multiple_and_dual(self):
        t, t2 = self.any((0, 1), (2, 3), (4, 7), (9, 8), (12, 14))
        kind = self.n(7)
        if kind == 5:  # behind the access
            return [0xE860 | self.n(2) << 7 | self.n(2) << 4 | BASE, t << 12 | t2 << 8 | self.n(4)]
        if kind == 6:  # 16 bits, BASE moves
            return [0xC000 | self.n(2) << 11 | BASE << 8 | self.any(1, 2, 3, 6, 0x19, 0x9F)]
        if kind < 2:
            write_back, imm = self.n(2), self.n(16)
            if write_back:
                imm &= 3
            return [0xE940 | self.n(2) << 7 | write_back << 5 | self.n(2) << 4 | BASE, t << 12 | t2 << 8 | imm]
        if kind == 2:
            return [0xE850 | BASE, t << 12 | 0xF00 | self.n(8)]  # LDREX
        registers = self.random.getrandbits(15) & 0x1F9F  # neither BASE, INDEX, SP nor LR
        if bin(registers).count("1") < 2:
            registers |= 0x0C
        return [self.any(0xE880, 0xE900) | self.n(2) << 5 | self.n(2) << 4 | BASE, registers]

    def exclusive(self):
        """A claim and a store of its width; or a store whose claim was given up."""
        t, d, kept = self.any((0, 1, 2), (2, 3, 4), (4, 7, 0), (9, 8, 12), (12, 14, 3))
        width, offset = self.n(3), self.n(8)
        load = [[0xE850 | BASE, t << 12 | 0xF00 | offset], [0xE8D0 | BASE, t << 12 | 0xF4F], [0xE8D0 | BASE, t << 12 | 0xF5F]][width]
        store = [[0xE840 | BASE, kept << 12 | d << 8 | offset], [0xE8C0 | BASE, kept << 12 | 0xF40 | d], [0xE8C0 | BASE, kept << 12 | 0xF50 | d]][width]
        return load + self.any([], [], [0xF3BF, 0x8F2F]) + store

    def special(self):
        """Flags to and from a register; the other system registers as an idle privileged thread reads them."""
        if self.n(2):
            return [0xF380 | self.source(), self.any(0x8800, 0x8400, 0x8C00)]
        return [0xF3EF, 0x8000 | self.reg() << 8 | self.any(0, 0, 1, 5, 16)]

    # --- control ------------------------------------------------------------------------------------------------------------------
    def if_then(self):
        """An IT block of one to four instructions."""
        count, condition = 1 + self.n(4), self.n(14)
        mask = 8 >> (count - 1)
        for i in range(1, count):
            mask |= ((condition & 1) ^ self.n(2)) << (4 - i)
        code = [0xBF00 | condition << 4 | mask]
        for _ in range(count):
            code += self.any(self.t16_data, self.t16_shift_add_move, self.t32_register)()
        return code

    def branch(self):
        """A branch over one instruction."""
        over = self.t32_register() + [0xBF00]
        return self.any([0xD000 | self.n(14) << 8 | 2], [0xB100 | self.n(2) << 11 | 0x10 | self.n(8)], [0xE002], [0xF000 | self.n(14) << 6, 0x8003]) + over

    def table_branch(self):
        """To one of four additions that follow each other, by a table behind the branch."""
        entry, m = self.n(4), self.low()
        additions = [0x3000 | self.low() << 8 | self.n(256) for _ in range(4)]
        if self.n(2):
            return [0x2000 | m << 8 | entry, 0xE8DF, 0xF000 | m, 0x0302, 0x0504] + additions
        return [0x2000 | m << 8 | entry, 0xE8DF, 0xF010 | m, 4, 5, 6, 7] + additions

    # --- floating point -------------------------------------------------------------------------------------------------------
    def fp_arithmetic(self):
        op = self.any(0, 1, 2, 3, 8, 9, 10)
        second = 0 if op == 8 else self.n(2)
        return [0xEE00 | (op & 8) << 4 | (op & 3) << 4 | self.n(2) << 6 | self.n(16),
                self.n(16) << 12 | 0xA00 | self.n(2) << 7 | second << 6 | self.n(2) << 5 | self.n(16)]

    def fp_convert(self):
        first, second = 0xEEB0 | self.n(2) << 6, self.n(16) << 12 | 0xA40
        kind = self.n(3)
        if kind == 0:
            return [first | self.any(8, 12, 13), second | self.n(2) << 7 | self.n(2) << 5 | self.n(16)]
        if kind == 1:
            return [first | self.any(2, 3), second | self.n(2) << 7 | self.n(2) << 5 | self.n(16)]
        wide = self.n(2)
        fraction = self.n(32 if wide else 17)  # size less the bits behind the point
        return [first | self.any(10, 11, 14, 15), second | wide << 7 | (fraction & 1) << 5 | fraction >> 1]

    def fp_other(self):
        first, second = 0xEEB0 | self.n(2) << 6, self.n(16) << 12 | 0xA40 | self.n(2) << 5 | self.n(16)
        kind = self.n(5)
        if kind == 0:
            return [first | self.n(16), second & 0xFF0F & ~0x40]
        if kind == 1:
            return [first | 5, second & 0xFF50 | self.n(2) << 7]
        if kind == 2:
            return [first | 4, second | self.n(2) << 7]
        return [first | self.n(2), second | self.n(2) << 7]

    def fp_move(self):
        kind, t = self.n(4), self.reg()
        if kind == 0:
            return [0xEE00 | self.n(2) << 4 | self.n(16), t << 12 | 0xA10 | self.n(2) << 7]
        if kind == 1:
            s = self.n(31)
            a, b = self.any((0, 1), (2, 3), (9, 8))
            return [0xEC40 | self.n(2) << 4 | a, b << 12 | 0xA10 | (s & 1) << 5 | s >> 1]
        if kind == 2:
            return [0xEE00 | self.n(2) << 5 | self.n(2) << 4 | self.n(16), t << 12 | 0xB10]
        return [0xEEF1, self.any(15, t) << 12 | 0xA10]

    def fp_transfer(self):
        load, kind = self.n(2) << 4, self.n(3)
        if kind == 0:
            return [0xED00 | self.n(2) << 7 | self.n(2) << 6 | load | BASE, self.n(16) << 12 | 0xA00 | self.n(32)]
        if kind == 1:
            return [0xED00 | self.n(2) << 7 | load | BASE, self.n(16) << 12 | 0xB00 | self.n(32)]
        count = 1 + self.n(8)
        return [0xEC80 | load | BASE, self.n(12) << 12 | 0xA00 | count]

    def fp_multiple(self):
        """VLDM and VSTM that move their base, up or down; VPUSH and VPOP."""
        count, double, load = 1 + self.n(6), self.n(2), self.n(2) << 4
        registers = 0xB00 | 2 * count if double else 0xA00 | count
        up = self.n(2)
        base = self.any(BASE, BASE, BASE, 13)
        return [(0xECA0 if up else 0xED20) | load | base, self.n(10) << 12 | registers]


INTEGER = ["t16_shift_add_move", "t16_data", "t16_high_extend_reverse", "t16_sp", "t32_shifted", "t32_immediate", "t32_plain_immediate", "t32_register",
           "multiply", "long_multiply_divide", "transfer", "t16_transfer", "multiple_and_dual", "if_then", "branch", "exclusive", "special",
           "table_branch"]
FLOATING = ["fp_arithmetic", "fp_convert", "fp_other", "fp_move", "fp_transfer", "fp_multiple"]
