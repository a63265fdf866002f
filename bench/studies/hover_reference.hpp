// What hovers of one vehicle without a defect have in common, and how well a few of them know it: two or three flights give a scatter of
// few degrees of freedom, and every limit drawn from it is Student's or Fisher's for that many.
#pragma once
#include <Eigen/Core>
#include <array>
#include <vector>

#include "bench/studies/hover_shares.hpp"

namespace rotorloop::studies {

constexpr double kHoverChance = 0.01;  // of an alarm on a flight without a defect, and of ruling out the kind that it is

struct HoverReference {
  std::size_t flights = 0;
  Eigen::Vector4d demand = Eigen::Vector4d::Zero();  // mean of each rotor
  Eigen::Vector4d u = Eigen::Vector4d::Zero();       // of another flight's relative change: its scatter and that of the mean
  double degrees = 0.0;                              // of u: flights less one, times four where the rotors' scatters are pooled
  bool pooled = false;
  // Natural logarithms of the sway's means by HoverChannel; u_sway is that of another flight's distance. 0 degrees: sway not known.
  Eigen::Vector4d log_sway = Eigen::Vector4d::Zero();
  double u_sway = 0.0, sway_degrees = 0.0;
};

// At least two hovers. Throws Error (data_quality) when they are of two vehicles: when they fall into two groups that differ by more than
// flights within a group do.
HoverReference hover_reference(const std::vector<HoverShare>& flights);

// Student's t that a variable exceeds with this chance, on the one side.
double student_limit(double chance, double degrees);

}  // namespace rotorloop::studies
