"""A second ULog reader, written from the format's description alone, to hold the writer of rotorloop against. Prints the flags, text
information, the number of messages of each topic, and the fields of each topic's last message. Refuses whatever is not exact."""

import struct
import sys

CODES = {"int8_t": "b", "uint8_t": "B", "int16_t": "h", "uint16_t": "H", "int32_t": "i", "uint32_t": "I", "int64_t": "q", "uint64_t": "Q",
         "float": "f", "double": "d", "bool": "?", "char": "c"}


def decode(formats, name, data, at, prefix=""):
    """Yields (path, value) of one message and returns where it ends."""
    for field in formats[name]:
        kind, label = field.split(" ")
        count = None
        if kind.endswith("]"):
            kind, number = kind[:-1].split("[")
            count = int(number)
        for i in range(count or 1):
            path = prefix + label + ("" if count is None else f"[{i}]")
            if kind in CODES:
                (value,) = struct.unpack_from("<" + CODES[kind], data, at)
                at += struct.calcsize("<" + CODES[kind])
                yield path, value
            else:
                at = yield from decode(formats, kind, data, at, path + ".")
    return at


def fields_of(formats, name, data):
    walk, out = decode(formats, name, data, 0), []
    while True:
        try:
            out.append(next(walk))
        except StopIteration as end:
            assert end.value == len(data), f"{name}: {len(data)} bytes, {end.value} described"
            return out


def main(path):
    log = open(path, "rb").read()
    assert log[:8] == b"ULog\x01\x12\x35\x01"
    formats, topics, info = {}, {}, []
    at, first, before = 16, True, struct.unpack_from("<Q", log, 8)[0]
    while at < len(log):
        size, kind = struct.unpack_from("<HB", log, at)
        body = log[at + 3:at + 3 + size]
        assert len(body) == size, "the last message is cut"
        at += 3 + size
        assert first == (kind == ord("B")), "the flags are the first message and no other"
        first = False
        if kind == ord("B"):
            compat, incompat, *appended = struct.unpack("<5Q", body)
            print(f"flags compat {compat} incompat {incompat} appended {' '.join(map(str, appended))}")
        elif kind == ord("F"):
            name, text = body.decode().split(":")
            formats[name] = [f for f in text.split(";") if f]
        elif kind == ord("I"):
            key = body[1:1 + body[0]].decode()
            kind_of_value, label = key.split(" ")
            value = body[1 + body[0]:]
            assert kind_of_value == f"char[{len(value)}]"
            info.append((label, value.decode()))
        elif kind == ord("A"):
            multi_id, number = struct.unpack_from("<BH", body)
            topics[number] = [body[3:].decode(), multi_id, []]
        elif kind == ord("D"):
            (number,) = struct.unpack_from("<H", body)
            message = fields_of(formats, topics[number][0], body[2:])
            assert message[0][0] == "timestamp" and message[0][1] >= before, "messages are in order of time"
            before = message[0][1]
            topics[number][2].append(message)
        elif kind == ord("S"):
            assert body == bytes([0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12])
        else:
            raise AssertionError(f"message of type {chr(kind)}")
    for label, value in info:
        print("info", label, value)
    for name, multi_id, messages in topics.values():
        print(f"{name} {multi_id}: {len(messages)}")
        for path, value in messages[-1]:
            print("last", name, multi_id, path, value)


main(sys.argv[1])
