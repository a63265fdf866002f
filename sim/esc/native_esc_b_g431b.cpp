#include "sim/esc/native_esc_body.hpp"

namespace rotorloop::sim {

template <>
const BoardStage& NativeEsc::stage() {
  return board_stages()[0];
}

template class BasicNativeEsc<firmware::B_G431B_ESC1_Scales>;

DriveParameters on_stage(DriveParameters drive, const BoardStage& stage) {
  drive.inverter = stage.inverter;
  drive.sensing = stage.sensing;
  drive.thermal = stage.thermal;
  return drive;
}

}  // namespace rotorloop::sim
