#!/bin/bash
# In the guest: the test, with the program of the emulated adapters. While the guest waits for the host's disk its clock runs on, so all that
# runs is read before.
set -e
for program in "$1" "$2" /sbin/ip /bin/sh; do cat "$program" $(ldd "$program" | grep -o '/[^ ]*') > /dev/null; done
ROTORLOOP_TEST_CANDLELIGHT=$1 exec "${@:2}"
