// How much of the scatter of a coefficient is between propellers, how much between mounts of one propeller, how much between repeats of one
// mount: nested random effects of unequal group sizes by the method of moments (Searle, Casella, McCulloch 1992, ch. 5), on the logarithm
// of the coefficient, so that all are relative.
#pragma once
#include <string>
#include <vector>

namespace rotorloop::stand {

struct LabelledValue {
  std::string propeller, mount;  // a mount is one of its propeller
  double value = 0.0;
};

struct VarianceComponent {
  std::string name;              // "between propellers", "between mounts", "between repeats"
  double deviation = 0.0;        // relative standard deviation; 0 where the mean squares leave none
  double low = 0.0, high = 0.0;  // 95 %: Satterthwaite's degrees of freedom; high infinite where there are none to speak of
  double degrees = 0.0;          // of its mean square
  double mean_square = 0.0;
};

struct VarianceComponents {
  std::vector<VarianceComponent> components;  // those that the numbers of groups allow
  std::size_t propellers = 0, mounts = 0, values = 0;
  double mean = 0.0;  // geometric
};
VarianceComponents variance_components(const std::vector<LabelledValue>& values);

}  // namespace rotorloop::stand
