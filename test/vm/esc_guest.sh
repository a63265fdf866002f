#!/bin/bash
# In the guest: the whole ESC by the tools, on vcan0, by the tests that also run on the simulated bus, multicast and SLCAN.
set -e
ip link add vcan0 type vcan
ip link set vcan0 mtu 72 up
ROTORLOOP_TEST_CAN=vcan0 exec "$1" --gtest_filter='*/SocketCan'
