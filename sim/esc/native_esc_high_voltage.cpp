#include "sim/esc/native_esc_body.hpp"

namespace rotorloop::sim {

template <>
const BoardStage& HighVoltageNativeEsc::stage() {
  return board_stages()[2];
}

template class BasicNativeEsc<firmware::HighVoltage14s120aScales>;

}  // namespace rotorloop::sim
