// The wire alone: no other package is needed for it.
#include "protocols/can_frame.hpp"
#include "protocols/crc.hpp"

int main() { return 0; }
