// Distributions, order statistics and corrections for many tests. Test values: tables of Abramowitz and Stegun (1964), chapter 26.
#pragma once
#include <span>
#include <vector>

namespace rotorloop {

// Upper tails: the chance that the variable is at least x. Degrees of freedom need not be whole numbers.
double chi_square_tail(double x, double degrees);
double f_tail(double x, double d1, double d2);
// Chance that a standard normal variable is at least |z| from zero, on either side.
double normal_two_sided(double z);
// Half width of the interval about zero that holds Student's t with the chance `level`, 0 < level < 1; fewer than one degree counts as one.
double student_quantile(double level, double degrees);

double quantile(std::vector<double> v, double fraction);  // the value next to that rank, none between two; 0 for no values
double median(std::vector<double> v);                     // likewise: the upper one of the middle two
double median_step(std::span<const double> t);            // of neighbours: median(t[i + 1] - t[i])
// Standard deviation of a normal distribution that has this median distance from its median.
double robust_deviation(const std::vector<double>& v);

// Holm (1979): p values adjusted for as many tests as there are, in the same order; below a level exactly where the step-down
// procedure rejects at that level.
std::vector<double> holm(std::span<const double> p);

}  // namespace rotorloop
