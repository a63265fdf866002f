#include "bench/sysid/identify/identify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "bench/sysid/estimate/flight_motion.hpp"
#include "bench/sysid/estimate/staged_fit.hpp"
#include "bench/sysid/identify/gauge.hpp"
#include "host/base/error.hpp"

namespace rotorloop::identify {
namespace {

constexpr int kRounds = 3;        // of fits again, with poses associated or dynamic terms propagated anew
constexpr double kSettled = 0.2;  // of a standard uncertainty: a change below it needs no further round

// What the stage, or a fit of any kind, cannot do without: named here, where the reader still knows which flight was meant for what.
void require_streams(const FlightToFit& f, const estimate::GridOptions& grid) {
  const log::FlightRecord& r = f.record;
  const std::string stage = f.role == FlightRole::any ? "the fit" : fmt::format("stage {}", name(f.role));
  const auto lacks = [&](const std::string& what, const std::string& columns) {
    throw Error({r.source.empty() ? r.name : r.source, fmt::format("{} needs {}, and this log has none", stage, what),
                 columns + " are missing", "log them, or name their columns in the mapping file (--mapping)"},
                ExitCode::data_quality);
  };
  if (r.rotor_omega_rad_s.empty() && r.motor_command.empty())
    lacks("rotor speeds or motor commands", "columns omega_1[rad/s] … omega_4[rad/s], or command_1[1] … command_4[1],");
  const bool pose = grid.use_pose && !r.pose.empty();
  if (!pose && (f.role == FlightRole::vertical || f.role == FlightRole::horizontal) && r.position_W_m.empty() && r.velocity_W_m_s.empty())
    lacks(f.role == FlightRole::vertical ? "climb speed (k_2 acts through it): poses, positions or velocities"
                                         : "speed (drag acts through it): poses, positions or velocities",
          "columns p_x[m] … q_z[1]");
  if (!pose && (r.gyro_B_rad_s.empty() || r.accel_B_m_s2.empty()))
    lacks("poses, or gyro and accelerometer", "columns p_x[m] … q_z[1], or gyro_x[rad/s] … accel_z[m/s2]");
  if (grid.use_velocity && r.velocity_W_m_s.empty()) lacks("velocities (--use velocity)", "columns v_x[m/s] … v_z[m/s]");
  if (grid.use_gyro && r.gyro_B_rad_s.empty()) lacks("gyro measurements (--use gyro)", "columns gyro_x[rad/s] … gyro_z[rad/s]");
  if (grid.use_accel && r.accel_B_m_s2.empty()) lacks("accelerometer measurements (--use accel)", "columns accel_x[m/s2] … accel_z[m/s2]");
}

// The segment that a moment belongs to: the nearest, for a measurement lies up to half a step from its node; -1 for none.
int segment_of(double t_s, const std::vector<log::TimeRange>& segments, double step_s) {
  int best = -1;
  double nearest = 0.5 * step_s + 2e-6;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const double away = std::max({0.0, segments[i].from_s - t_s, t_s - segments[i].to_s});
    if (away < nearest) {
      nearest = away;
      best = static_cast<int>(i);
    }
  }
  return best;
}

// Associates each flight's poses with the nodes of the moments they show. True when a delay differs from the last one by so much that the
// fit must go on.
bool associate_again(std::vector<estimate::GridFlight>& flights, std::vector<double>& tied_s, const std::vector<double>& delay_s) {
  bool moved = false;
  for (std::size_t f = 0; f < flights.size(); ++f) {
    if (flights[f].pose.empty() || std::fabs(delay_s[f] - tied_s[f]) <= 0.5 * flights[f].step_s) continue;
    estimate::associate_poses(flights[f], delay_s[f]);
    tied_s[f] = delay_s[f];
    moved = true;
  }
  return moved;
}

// Stateful terms follow the states, and the states follow from the fit. True when the fit found with the motion of before
// differs from the one before that by more than rounding of its uncertainty, so that it must go on.
bool repropagate(std::vector<estimate::GridFlight>& flights, const estimate::Fit& fit, const std::vector<estimate::Estimate>& before) {
  estimate::follow_states(flights, fit.states);
  if (before.size() != fit.estimates.size()) return true;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (std::fabs(fit.estimates[i].value - before[i].value) > kSettled * fit.estimates[i].u) return true;
  }
  return false;
}

}  // namespace

void cut_between_segments(estimate::GridFlight& g, const std::vector<log::TimeRange>& segments) {
  if (segments.empty()) return;
  for (std::size_t k = 0; k + 1 < g.nodes; ++k) {
    const int from = segment_of(g.time_s(k), segments, g.step_s), to = segment_of(g.time_s(k + 1), segments, g.step_s);
    if (from < 0 || from != to) g.linked[k] = 0;
  }
  estimate::drop_short_pieces(g);
}

namespace {

constexpr std::array kStages{FlightRole::vertical, FlightRole::horizontal, FlightRole::rotation};

// An identification under way: grids, stages, joint fit.
class Sequence {
 public:
  Sequence(const std::vector<FlightToFit>& given, const host::VehicleFile& vehicle, const IdentifyOptions& options,
           const std::function<void(const IdentifyProgress&)>& progress);
  void run_stages();
  void pose_joint_problem();
  void fit_jointly();
  void keep_possible();
  Identification take() { return std::move(out_); }

 private:
  void choose_start_values();
  void choose_priors();
  bool weigh_priors();
  bool weigh_mass();
  void settle_jointly(const std::function<void(const estimate::FitProgress&)>& joint);
  InertiaCheck look_at_inertia(bool ended) const;
  bool refit(const std::vector<estimate::JointPrior>& more);
  estimate::ModelValues file_values() const;
  void run(FlightRole role, Knowledge& known);
  std::function<void(const estimate::FitProgress&)> report(const std::string& what);
  void associate_all() { associate_again(out_.flights, tied_s_, std::vector<double>(given_.size(), values_[estimate::kPoseDelay])); }

  const std::vector<FlightToFit>& given_;
  const host::VehicleFile& vehicle_;
  const IdentifyOptions& o_;
  const std::function<void(const IdentifyProgress&)>& progress_;
  Identification out_;
  std::vector<estimate::FreeParameter> free_;
  std::vector<estimate::JointPrior> priors_;
  estimate::ModelValues values_;                   // as the last stage left them
  estimate::NoiseModel noise_;                     // likewise
  std::vector<double> tied_s_;                     // delay that each flight's poses are associated by
  std::vector<std::vector<double>> flight_start_;  // values of each flight, as its own stage left them
  int parts_ = 1, part_ = 0;                       // of the progress: stages and joint fit
  std::function<void(const estimate::FitProgress&)> joint_;
};

Sequence::Sequence(const std::vector<FlightToFit>& given, const host::VehicleFile& vehicle, const IdentifyOptions& options,
                   const std::function<void(const IdentifyProgress&)>& progress)
    : given_(given), vehicle_(vehicle), o_(options), progress_(progress), noise_(options.noise), tied_s_(given.size(), 0.0) {
  out_.flights.reserve(given.size());
  for (const FlightToFit& f : given) {
    require_streams(f, o_.grid);
    out_.flights.push_back(make_grid(f.record, o_.grid));
    cut_between_segments(out_.flights.back(), f.segments);
  }
  free_ = choose_parameters(out_.flights, vehicle, o_.terms, o_.wishes);
  choose_start_values();
  if (o_.priors) choose_priors();
  for (const FlightRole role : kStages)
    parts_ += std::any_of(given.begin(), given.end(), [&](const FlightToFit& f) { return f.role == role; });
  associate_all();
  if (o_.terms.memory() == 0) return;
  for (estimate::GridFlight& g : out_.flights)
    estimate::follow_states({&g, 1}, std::array{estimate::states_by_measurements(g, values_, o_.noise)});
}

void Sequence::choose_start_values() {
  out_.start = start_values(out_.flights, vehicle_, o_.terms);
  // The file may know a rotor's inertia by another name.
  for (const std::string_view name : estimate::kRotorInertiaNames) {
    const int parameter = estimate::find_parameter(name, o_.terms);
    if (parameter < 0 || host::uncertainty_of(vehicle_, name)) continue;
    out_.start.file[parameter] = out_.start.values[parameter] = vehicle_.rotor_inertia_kg_m2.value;
  }
  values_ = out_.start.values;
  // A delay that is held stays at its start value, whatever the checks found.
  const bool delay_is_free =
      std::any_of(free_.begin(), free_.end(), [](const estimate::FreeParameter& f) { return f.parameter == estimate::kPoseDelay; });
  double late_s = 0.0, known = 0.0;
  for (const FlightToFit& f : given_) {
    if (f.pose_late_s) {
      late_s += *f.pose_late_s;
      known += 1.0;
    }
  }
  if (delay_is_free && known > 0.0) values_[estimate::kPoseDelay] += late_s / known;
}

// Those of the file, and of delays: streams are some tens of milliseconds apart, not hundreds. Without quick turns a delay would else run
// off to where it hides what the model lacks.
void Sequence::choose_priors() {
  // Where the checks have seen the poses beside the gyro only the rotors' clock is left, tens of milliseconds off at the most.
  const bool seen = std::any_of(given_.begin(), given_.end(), [](const FlightToFit& f) { return f.pose_late_s.has_value(); });
  const double delay_s = seen ? 0.01 : 0.03;
  priors_ = o_.priors(vehicle_, free_, out_.start.file);
  // A guess of thrust that does not carry the weight is worth what is left of it once it does.
  for (estimate::JointPrior& prior : priors_) {
    const int p = prior.parameters.front();
    if (!prior.weak || (p != estimate::kK1 && p != estimate::kK2 && p != estimate::kCq)) continue;
    const double scale = out_.start.file[p] != 0.0 ? out_.start.values[p] / out_.start.file[p] : 1.0;
    prior.mean *= scale;
    prior.information /= scale * scale;
  }
  for (const estimate::FreeParameter& f : free_) {
    if ((f.parameter != estimate::kPoseDelay && f.parameter != estimate::kRotorDelay) || f.per_flight || f.prior_u > 0.0) continue;
    priors_.push_back({{f.parameter},
                       Eigen::VectorXd::Constant(1, values_[f.parameter]),
                       Eigen::MatrixXd::Constant(1, 1, 1.0 / (delay_s * delay_s)),
                       1.0,
                       true});
  }
}

std::function<void(const estimate::FitProgress&)> Sequence::report(const std::string& what) {
  ++part_;
  return [&progress = progress_, what, parts = parts_, part = part_](const estimate::FitProgress& p) {
    if (progress) progress({what, part, parts, p});
  };
}

void Sequence::run_stages() {
  flight_start_.assign(given_.size(), values_.values);
  Knowledge known = first_knowledge(free_, vehicle_, values_);
  for (const FlightRole role : kStages) run(role, known);
}

void Sequence::run(FlightRole role, Knowledge& known) {
  std::vector<const estimate::GridFlight*> flights;
  std::vector<std::size_t> which;
  for (std::size_t f = 0; f < given_.size(); ++f) {
    if (given_[f].role != role) continue;
    flights.push_back(&out_.flights[f]);
    which.push_back(f);
  }
  if (flights.empty()) return;
  out_.stages.push_back(
      run_stage(role, flights, free_, priors_, values_, known, noise_, o_.fit, o_.solver, report(fmt::format("stage {}", name(role)))));
  out_.stages.back().flights = which;
  for (const std::size_t f : which) flight_start_[f] = values_.values;
  associate_all();
}

void Sequence::pose_joint_problem() {
  out_.problem = {.start = values_, .free = free_, .flights = {}, .noise = noise_, .flight_noise = {}, .flight_start = {}};
  for (const estimate::GridFlight& g : out_.flights) out_.problem.flights.push_back(&g);
  // Shared parameters start from what the last stage left; those of a flight from its own stage.
  for (const std::vector<double>& own : flight_start_) {
    std::vector<double>& merged = out_.problem.flight_start.emplace_back(values_.values);
    for (const estimate::FreeParameter& f : free_) {
      if (f.per_flight) merged[static_cast<std::size_t>(f.parameter)] = own[static_cast<std::size_t>(f.parameter)];
    }
  }
  // Priors are about the values of the vehicle file, not about what a stage made of them.
  for (const estimate::FreeParameter& f : free_) {
    if (f.prior_u <= 0.0) continue;
    const auto at = static_cast<std::size_t>(f.parameter);
    out_.problem.start.values[at] = out_.start.file.values[at];
    for (auto& own : out_.problem.flight_start) own[at] = out_.start.file.values[at];
  }
  out_.problem.priors = priors_;
  for (const auto& group : rotor_groups(o_.terms, free_)) {
    const auto first = static_cast<std::size_t>(group.front() - estimate::kCoreParameters);
    const std::string_view id = o_.terms.term(o_.terms.term_of(first)).info.id;
    out_.problem.priors.push_back(prior_of_sum(group, out_.start.file, common_part_known(id, priors_)));
  }
}

// Gives each prior the weight that the last fit asks for. True when one changes by so much that the fit must go on.
bool Sequence::weigh_priors() {
  constexpr double kMost = 25.0;    // beyond it the scatter of so few blocks says no more than "much"
  constexpr double kMatters = 1.5;  // of a weight: less moves an estimate by less than its u
  bool changed = false;
  for (std::size_t i = 0; i < priors_.size(); ++i) {  // those behind them hold what no flight determines
    estimate::JointPrior& prior = out_.problem.priors[i];
    double sum = 0.0, count = 0.0;
    for (const int parameter : prior.parameters) {
      const estimate::Estimate* e = out_.fit.find(parameter);
      if (e && e->u > 0.0 && std::isfinite(e->u_robust)) {
        sum += e->u_robust * e->u_robust / (e->u * e->u);
        count += 1.0;
      }
    }
    const double weight = count > 0.0 ? std::clamp(sum / count, 1.0, kMost) : 1.0;
    if (weight < kMatters * prior.weight) continue;
    prior.weight = weight;
    changed = true;
  }
  changed = weigh_mass() || changed;
  return changed;
}

// The mass's own prior stands with its parameter: what it lacks in weight w is a second one, of information (w - 1)/u² and scatter (w² -
// 1)/u².
bool Sequence::weigh_mass() {
  const auto mass =
      std::find_if(free_.begin(), free_.end(), [](const estimate::FreeParameter& f) { return f.parameter == estimate::kMass; });
  if (mass == free_.end() || mass->prior_u <= 0.0) return false;
  double largest = 1.0;
  for (const estimate::JointPrior& prior : out_.problem.priors) largest = std::max(largest, prior.weight);
  if (largest == 1.0) return false;
  estimate::JointPrior more{{estimate::kMass},
                            Eigen::VectorXd::Constant(1, out_.start.file[estimate::kMass]),
                            Eigen::MatrixXd::Constant(1, 1, (largest - 1.0) / ((largest + 1.0) * mass->prior_u * mass->prior_u))};
  more.weight = largest + 1.0;
  out_.problem.priors.push_back(std::move(more));
  return true;
}

void Sequence::settle_jointly(const std::function<void(const estimate::FitProgress&)>& joint) {
  if (o_.priors && o_.hold_priors_first)
    estimate::settle_with_priors_held(out_.problem, [&](const estimate::FitProblem& held) { return o_.solver(held, o_.fit, joint); });
  out_.fit = o_.solver(out_.problem, o_.fit, joint);
  if (o_.priors_against_scatter && out_.fit.converged && weigh_priors()) {
    estimate::start_from(out_.fit, out_.problem);
    out_.fit = o_.solver(out_.problem, o_.fit, joint);
  }
  std::vector<estimate::Estimate> before;
  for (int again = 0; again < kRounds && (again == 0 || out_.fit.converged); ++again) {
    std::vector<double> found_s;
    for (const estimate::ModelValues& v : out_.fit.values) found_s.push_back(v[estimate::kPoseDelay]);
    const bool tied = associate_again(out_.flights, tied_s_, found_s);
    const bool repropagated = o_.terms.memory() > 0 && repropagate(out_.flights, out_.fit, before);
    if (!tied && !repropagated) break;
    before = out_.fit.estimates;
    estimate::start_from(out_.fit, out_.problem);
    out_.fit = o_.solver(out_.problem, o_.fit, joint);
  }
}

void Sequence::fit_jointly() {
  joint_ = report("joint fit");
  try {
    settle_jointly(joint_);
  } catch (const Error& e) {
    // What the flights leave open over all frequencies a band may determine.
    if (!o_.keep_possible || e.exit_code() != ExitCode::data_quality) throw;
    out_.inertia = look_at_inertia(false);
    const auto priors = priors_of(out_.inertia, vehicle_, free_, file_values());
    if (priors.empty()) throw;  // all of them are held by the user
    for (const estimate::JointPrior& p : priors) out_.problem.priors.push_back(p);
    settle_jointly(joint_);
  }
  if (o_.keep_possible && !o_.fit.stop.asked()) keep_possible();
  out_.comparison = compare_stages(out_.stages, out_.fit);
}

InertiaCheck Sequence::look_at_inertia(bool ended) const {
  std::vector<const log::FlightRecord*> records;
  for (const FlightToFit& f : given_) records.push_back(&f.record);
  if (ended) return check_inertia(records, out_.flights, out_.fit.states, out_.fit.values, out_.fit.converged ? &out_.fit : nullptr);
  std::vector<std::vector<estimate::BodyState>> states;
  for (const estimate::GridFlight& g : out_.flights) states.push_back(estimate::states_by_measurements(g, values_, o_.noise));
  return check_inertia(records, out_.flights, states, std::vector(out_.flights.size(), values_), nullptr);
}

// Adds priors and goes on from the last fit. False when there is nothing to add.
bool Sequence::refit(const std::vector<estimate::JointPrior>& more) {
  if (more.empty()) return false;
  for (const estimate::JointPrior& p : more) out_.problem.priors.push_back(p);
  estimate::start_from(out_.fit, out_.problem);
  out_.fit = o_.solver(out_.problem, o_.fit, joint_);
  return true;
}

// As the vehicle file says; a guessed c_q with the scale at which thrust carries the weight.
estimate::ModelValues Sequence::file_values() const {
  estimate::ModelValues out = out_.start.file;
  if (vehicle_.c_q_N_m_s2.origin == host::Origin::guess) out[estimate::kCq] = out_.start.values[estimate::kCq];
  return out;
}

void Sequence::keep_possible() {
  if (!out_.inertia.needed) {
    out_.inertia = look_at_inertia(true);
    refit(priors_of(out_.inertia, vehicle_, free_, file_values()));
  }
  for (int again = 0; again < kRounds && out_.fit.converged; ++again) {
    if (!refit(priors_of_the_possible(out_.fit, vehicle_, file_values(), out_.wanted))) break;
  }
  // What a band of these flights determines is theirs, though the fit had it from a prior.
  for (estimate::Estimate& e : out_.fit.estimates) {
    const InertiaByBand* band = e.flight < 0 ? out_.inertia.of(e.parameter) : nullptr;
    if (band && band->taken) {
      e.prior_share = 0.0;
      e.u = e.u_robust;
    }
    if (e.parameter == estimate::kCq) continue;  // the file's
    const bool stopped =
        std::any_of(out_.wanted.begin(), out_.wanted.end(), [&](const estimate::Estimate& w) { return w.parameter == e.parameter; });
    e.at_bound = e.at_bound || (e.flight < 0 && stopped);
  }
}

}  // namespace

Identification identify(const std::vector<FlightToFit>& given, const host::VehicleFile& vehicle, const IdentifyOptions& o,
                        const std::function<void(const IdentifyProgress&)>& progress) {
  Sequence sequence(given, vehicle, o, progress);
  sequence.run_stages();
  sequence.pose_joint_problem();
  sequence.fit_jointly();
  return sequence.take();
}

}  // namespace rotorloop::identify
