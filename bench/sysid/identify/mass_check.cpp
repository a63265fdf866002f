#include "bench/sysid/identify/mass_check.hpp"

#include <fmt/format.h>

#include <cmath>

#include "bench/sysid/identify/identified_vehicle.hpp"

namespace rotorloop::identify {

// Chance moves a mass by five of its u once in two million fits: what is beyond is no chance of the scales.
constexpr double kByChance = 5.0;

std::optional<Error> mass_contradicted(const Identification& r, const host::VehicleFile& vehicle) {
  const estimate::Estimate* e = r.fit.find(estimate::kMass);
  const host::Quantity& said = vehicle.mass_kg;
  if (!e || said.origin == host::Origin::guess || said.u <= 0.0) return std::nullopt;
  const double moved = (e->value - said.value) / said.u;
  if (std::fabs(moved) < kByChance) return std::nullopt;
  return Error(
      {"body.mass_kg",
       fmt::format("the flights want a mass of {:.2f} ± {:.2f} g where the file has {:.2f} ± {:.2f} g ({}): {:.1f} of its u, allowed 5",
                   1e3 * e->value, 1e3 * reported_u(*e), 1e3 * said.value, 1e3 * said.u, host::name(said.origin), std::fabs(moved)),
       "the vehicle flew with another battery or load than it was weighed with, u is smaller than the scales allow, or the model puts a "
       "force that it lacks into the mass",
       "weigh it as it flew and give that mass with its u; when it is right, hold it (--hold body.mass) and let `rotorloop diagnose` "
       "look for the force"},
      ExitCode::data_quality);
}

}  // namespace rotorloop::identify
