// Pose time offset: poses that are stamped late, found by every fit that frees their delay.
#pragma once
#include <optional>

#include "bench/sysid/diagnose/decision_rules.hpp"
#include "bench/sysid/diagnose/diagnosis.hpp"

namespace rotorloop::diagnose {

// How late the poses are stamped is free in every fit, and no candidate therefore: a delay that matters, mean over the flights, is a
// finding all the same, and as a fault of a sensor the first.
std::optional<AddedEffect> pose_time_offset(const estimate::Fit& fit, const Criteria& criteria);

}  // namespace rotorloop::diagnose
