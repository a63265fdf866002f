#!/bin/bash
# In the guest: the whole ESC by the tools, on two emulated adapters whose channels are one bus, and on vcan0 where the filter has it. What runs
# is read before: while the guest waits for the host's disk its clock runs on.
# usage: gs_usb_esc_guest.sh CANDLELIGHT TEST FILTER
set -e
for program in "$1" "$2"; do cat "$program" $(ldd "$program" | grep -o '/[^ ]*') > /dev/null; done
(echo "plug TOOL 2 0"; echo "plug ESC 1 0"; sleep 100000) | "$1" > /dev/null &
for ((i = 0; i < 300; ++i)); do
  [ "$(cat /sys/bus/usb/devices/*/serial 2> /dev/null | grep -c -e TOOL -e ESC)" = 2 ] && [ -e /sys/class/net/can2 ] && break
  sleep 0.01
done
ip link add vcan0 type vcan
ip link set vcan0 mtu 72 up
ROTORLOOP_TEST_CAN=vcan0 ROTORLOOP_TEST_GSUSB=1 exec "$2" --gtest_filter="$3"
