// The node as the firmware uses it, compiled once.
#include "firmware/core/node/esc_node.hpp"

namespace rotorloop::firmware {
template class BasicEscNode<kAllRules>;
}  // namespace rotorloop::firmware
