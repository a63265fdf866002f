// One ESC's idea of its speed is off by a constant factor: a wrong resonator or magnet count. It holds the set-point by its own
// measure, so the rotor really turns 1 / (1 + error) as fast, while commands and reports agree.
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

class RotorSpeedScale final : public Effect {
 public:
  explicit RotorSpeedScale(const EffectValues& v) : error_(v[0]), rotor_(static_cast<std::size_t>(v[1]) - 1) {}
  void prepare(PlantSetup& setup) override { setup.esc[rotor_].speed_scale *= 1.0 + error_; }

 private:
  double error_;
  std::size_t rotor_;
};

constexpr EffectOption kOptions[]{{"rotor", "1", 1.0, 4.0, 1.0, true}};

}  // namespace

const EffectInfo kRotorSpeedScale{
    .id = "rotor_speed_scale", .parameter = {"error", "1", -0.2, 0.2, 0.0}, .options = kOptions, .make = make_effect<RotorSpeedScale>};

}  // namespace rotorloop::sim
