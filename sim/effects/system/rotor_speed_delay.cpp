// Everything that the ESCs send passes a slow gateway: speeds reach log and controller later than the pose of the same instant.
// Physics is untouched; forces computed from logged speeds lag behind the motion.
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

class RotorSpeedDelay final : public Effect {
 public:
  explicit RotorSpeedDelay(const EffectValues& v) : delay_ns_(static_cast<std::int64_t>(v[0] * 1e9 + 0.5)) {}
  void prepare(PlantSetup& setup) override {
    for (EscSetup& e : setup.esc) e.report_delay_ns += delay_ns_;
  }

 private:
  std::int64_t delay_ns_;
};

}  // namespace

const EffectInfo kRotorSpeedDelay{
    .id = "rotor_speed_delay", .parameter = {"delay_s", "s", 0.0, 0.05, 0.0}, .options = {}, .make = make_effect<RotorSpeedDelay>};

}  // namespace rotorloop::sim
