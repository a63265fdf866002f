#!/bin/bash
# In the guest: interfaces as the test wants them, then the test. vcan1 has a controller's pace and queue: 1 Mbit/s of the 16 bytes that a
# frame is for the kernel, 10 frames of queue, and so ENOBUFS, which vcan alone never gives.
set -e
for name in vcan0 vcan1; do ip link add $name type vcan; ip link set $name mtu 72 up; done
ip link add vxcan0 type vxcan peer name vxcan1
for name in vxcan0 vxcan1; do ip link set $name mtu 72 up; done
tc qdisc add dev vcan1 root tbf rate 1mbit burst 160 limit 160
exec "$@"
