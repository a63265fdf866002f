// A flight on the grid of the fit: nodes at equal distance, at which the state is unknown, and measurements associated with their nearest
// node.
#pragma once
#include <cstdint>
#include <vector>

#include "bench/sysid/estimate/model/model.hpp"
#include "bench/sysid/estimate/model/rotor_input.hpp"
#include "bench/sysid/log/check/checked_flight.hpp"
#include "bench/sysid/log/flight_record.hpp"

namespace rotorloop::estimate {

struct PoseFix {
  std::size_t node;
  double late_s;  // stamp minus node; less the sensor's delay, at most half a step either way
  log::PoseReading value;
};
struct VectorFix {
  std::size_t node;
  double late_s;  // mean stamp of what was averaged, minus node
  Eigen::Vector3d value;
};

struct GridOptions {
  double rate_Hz = 200.0;             // of nodes; 0: that of the pose, but 100 to 500 Hz
  double longest_substep_s = 2.6e-3;  // of the integration between nodes
  bool slopes_by_middle = false;      // derivatives as Model::step_by_middle has them
  double from_s = -1e300, to_s = 1e300;
  bool use_load = false;  // place of a load on a string, streams payload_x[m] … payload_z[m]
  bool use_pose = true, use_velocity = false, use_gyro = false, use_accel = false;
  double longest_gap_s = log::kLongestInputGap_s;  // of rotor speeds: beyond it the chain of states is cut
};

struct GridFlight {
  std::string name;
  double start_s = 0.0, step_s = 0.0;
  std::size_t nodes = 0;
  int substeps = 1;
  bool slopes_by_middle = false;
  std::vector<std::uint8_t> linked;  // node k and k+1 are tied by the model (nodes - 1 entries)
  std::vector<PoseFix> pose;         // each list in order of nodes
  std::vector<VectorFix> position, velocity, gyro, accel;
  std::vector<Eigen::Vector3d> load_W_m;  // place of a load that was measured too, at each node; else empty
  RotorInput input;
  // Without poses the start of each piece is held near its guess: standard deviations in the order of StateError; 0: free.
  StateError anchor = StateError::Zero();

  double time_s(std::size_t node) const { return start_s + static_cast<double>(node) * step_s; }
  // Whether this node begins a piece: nothing ties it to the one before.
  bool begins(std::size_t node) const { return node == 0 || !linked[node - 1]; }
  // Whether the model ties this node to a neighbour; only such nodes are estimated.
  bool tied(std::size_t node) const { return (node > 0 && linked[node - 1]) || (node + 1 < nodes && linked[node]); }
  std::size_t tied_nodes() const;
};

// The node on the other side of a measurement's moment; its own where there is none, or where a cut lies between.
std::size_t neighbour(const GridFlight& flight, const VectorFix& fix);

// Sensors faster than the grid are averaged around each node. Throws Error (data_quality) naming the missing stream, or when fewer than
// one second is left.
GridFlight make_grid(const log::FlightRecord& record, const GridOptions& options);

// Unties pieces between cuts that are too short to hold a state by themselves (below 0.2 s, or fewer than four poses) and drops their
// measurements. To be called after links were cut. Throws Error (data_quality) when less than one second stays tied.
void drop_short_pieces(GridFlight& flight);

// Poses are associated with the node next to the moment they show: their stamp less `delay_s`. From there to the moment the state is
// carried on in a straight line, so a fit that finds a delay more than half a step from this one must associate them again and go on.
void associate_poses(GridFlight& flight, double delay_s);

// First guess of all states: poses (or position and gyro) smoothed; without poses the gyro is integrated and levelled by the accelerometer.
std::vector<BodyState> guess_states(const GridFlight& flight, const ModelValues& values);

}  // namespace rotorloop::estimate
