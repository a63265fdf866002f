"""A Modbus client of another make: prints what pymodbus reads, as JSON. Arguments: tcp:PORT or rtu:PATH, slave, address, count."""
import json
import sys

from pymodbus.client import ModbusSerialClient, ModbusTcpClient

port, slave, address, count = sys.argv[1], *map(int, sys.argv[2:5])
client = ModbusTcpClient("127.0.0.1", port=int(port[4:])) if port.startswith("tcp:") else ModbusSerialClient(port[4:], baudrate=115200, timeout=30)
assert client.connect()
answer = client.read_holding_registers(address, count, slave=slave)
print(json.dumps({"error": str(answer)} if answer.isError() else {"registers": answer.registers}))
client.close()
