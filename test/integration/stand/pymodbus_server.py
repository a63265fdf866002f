"""A Modbus server of another make: pymodbus with registers that its caller gives. Arguments: port, then JSON {"holding": {"7": 1}, "input": {}}.
Says "listening" when it does."""
import asyncio
import json
import sys

from pymodbus.datastore import ModbusSequentialDataBlock, ModbusServerContext, ModbusSlaveContext
from pymodbus.server.async_io import ModbusTcpServer


def block(registers):
    values = [0] * 0x3000
    for address, value in registers.items():
        values[int(address)] = value
    return ModbusSequentialDataBlock(0, values)


spaces = json.loads(sys.argv[2])
store = ModbusSlaveContext(hr=block(spaces["holding"]), ir=block(spaces["input"]), zero_mode=True)


async def serve():
    server = ModbusTcpServer(ModbusServerContext(slaves=store, single=True), address=("127.0.0.1", int(sys.argv[1])))
    serving = asyncio.create_task(server.serve_forever())
    await server.serving
    print("listening", flush=True)
    await serving

asyncio.run(serve())
