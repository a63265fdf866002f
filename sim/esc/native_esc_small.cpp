#include "sim/esc/native_esc_body.hpp"

namespace rotorloop::sim {

template <>
const BoardStage& SmallNativeEsc::stage() {
  return board_stages()[1];
}

template class BasicNativeEsc<firmware::Small2s15aScales>;

}  // namespace rotorloop::sim
