// Which flight tells two effects apart: pairs whose physics says the answer, and flights of another simulator that keep the promise.
#include "bench/diagnose/manoeuvre_search.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <chrono>
#include <fmt/format.h>

#include "bench/identify/identify.hpp"
#include "host/vehicle/vehicle_file.hpp"
#include "test/support/model_true_flight.hpp"

namespace rotorloop::bench {
namespace {

using model_true::Manoeuvre;

const Identification& clean_fit() {
  static const Identification r = [] {
    std::vector<FlightToFit> flights;
    for (const Manoeuvre m : {Manoeuvre::vertical, Manoeuvre::horizontal, Manoeuvre::rotation}) {
      model_true::FlightSettings s;
      s.manoeuvre = m;
      s.seed = 21 + static_cast<std::uint64_t>(m);
      s.duration_s = 10.0;
      flights.push_back({model_true::fly({}, s).record, FlightRole::any, {}, {}});
    }
    IdentifyOptions o;
    o.grid.rate_Hz = 100.0;
    o.noise.force_m_s2_rtHz.setConstant(0.03);
    o.noise.angular_rad_s2_rtHz.setConstant(0.3);
    return identify(flights,
                    host::read_vehicle(std::string(ROTORLOOP_SOURCE_DIR) + "/vehicles/paper.toml", host::builtin_effect_catalogue()), o);
  }();
  return r;
}

Member member(const std::string& id, const std::vector<double>& sizes) {
  Member m{id, {}};
  const host::Term* t = host::find_term(id);
  for (std::size_t k = 0; k < sizes.size(); ++k)
    m.parameters.push_back({std::string(t->info.parameters[k].name), std::string(t->info.parameters[k].unit), sizes[k], 0.0});
  return m;
}

TEST(Explore, Pairs) {
  const auto show = [](const std::vector<Member>& pair) {
    const auto t0 = std::clock();
    const ManoeuvreAdvice a = rank_manoeuvres(clean_fit(), clean_fit(), pair, {.threads = 1});
    fmt::print("== {} / {}  cpu {:.2f} s\n", pair[0].id, pair[1].id, double(std::clock() - t0) / CLOCKS_PER_SEC);
    for (auto& v : a.ranked) fmt::print("   {:<20} {:9.3f}   {}\n", v.id, v.separation[0], v.words);
    for (auto& v : a.impossible) fmt::print("   impossible {}\n", v);
  };
  show({member("rotor_plane_height", {0.03}), member("hub_moment", {1e-6, 1e-6})});
  show({member("ground_effect_rotor", {2.0}), member("thrust_scale", {0.97})});
  show({member("wind_steady", {1.0, 0.0, 0.0}), member("gravity_tilt", {0.02, 0.0})});
  show({member("body_force_bias", {0.13, 0.0, 0.0}), member("gravity_tilt", {0.02, 0.0})});
  show({member("body_lift", {2e-3}), member("thrust_scale", {0.97})});
}

}  // namespace
}  // namespace rotorloop::bench
