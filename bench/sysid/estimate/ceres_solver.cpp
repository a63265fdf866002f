#include "bench/sysid/estimate/ceres_solver.hpp"

#include <ceres/covariance.h>
#include <ceres/loss_function.h>
#include <ceres/normal_prior.h>
#include <ceres/problem.h>
#include <ceres/product_manifold.h>
#include <ceres/solver.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <string>

#include "bench/sysid/estimate/ceres_blocks.hpp"
#include "host/base/error.hpp"
#include "host/base/symmetric_matrix.hpp"

namespace rotorloop::estimate {
namespace {

// Undamped from the first step on, as Gauss-Newton is: damping of 1e-4, Ceres's default, slows the weak directions of a chain of
// states down to hundreds of iterations. A step that fails shrinks the region.
constexpr double kFirstRegion = 1e16;

[[noreturn]] void fail(const FitProblem& p, const std::string& what, const std::string& likely, const std::string& remedy) {
  throw Error({p.flights.front()->name, what, likely, remedy}, ExitCode::data_quality);
}

// Which number of which block an estimate is.
struct Place {
  ParameterBlock* block;
  std::size_t at;
};

struct Unknowns {
  Columns columns;
  ParameterBlock shared;
  std::vector<ParameterBlock> own;  // of each flight
  std::vector<Estimate> estimates;  // at their start
  std::vector<Place> places;        // of the estimates
  std::vector<double> prior_u;      // of the estimates
};

std::vector<double> start_values(const FitProblem& p, std::size_t flight) {
  return p.flight_start.empty() ? p.start.values : p.flight_start[flight];
}

std::unique_ptr<Unknowns> make_unknowns(const FitProblem& p) {
  auto u = std::make_unique<Unknowns>();
  u->own.resize(p.flights.size());
  for (const FreeParameter& f : p.free) {
    const std::size_t column = u->columns.size();
    u->columns.push_back(f.parameter);
    const double scale = parameter_info(f.parameter, p.start.terms).scale;
    const auto add = [&](ParameterBlock& b, int flight, double value) {
      b.column.push_back(column);
      b.scale.push_back(scale);
      b.number.push_back(value / scale);
      u->estimates.push_back({.parameter = f.parameter, .flight = flight, .value = value});
      u->places.push_back({&b, b.column.size() - 1});
      u->prior_u.push_back(f.prior_u);
    };
    if (!f.per_flight) add(u->shared, -1, p.start[f.parameter]);
    for (std::size_t i = 0; f.per_flight && i < p.flights.size(); ++i)
      add(u->own[i], static_cast<int>(i), start_values(p, i)[static_cast<std::size_t>(f.parameter)]);
  }
  return u;
}

// How far an estimate lies outside its range, in units of its scale, and the nearest value allowed; 0 inside.
struct Excess {
  double by = 0.0, nearest = 0.0;
  ParameterInfo info;
};
Excess excess_of(const FitProblem& p, const Unknowns& u, const Place& place) {
  Excess e{.info = parameter_info(u.columns[place.block->column[place.at]], p.start.terms)};
  const double value = place.block->value(place.at);
  e.nearest = std::clamp(value, e.info.min, e.info.max);
  e.by = std::fabs(value - e.nearest) / e.info.scale;
  if (e.by < 1e-9) e.by = 0.0;  // rounding by the scale of one that is held
  return e;
}

// The least-squares problem with all that it points to.
struct CeresProblem {
  std::unique_ptr<Unknowns> unknowns;
  std::vector<std::unique_ptr<CeresFlight>> flights;
  RenewFlights renew{flights};
  ceres::ProductManifold<ceres::EuclideanManifold<6>, ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>> manifold;
  std::unique_ptr<ceres::LossFunction> loss;
  std::vector<std::unique_ptr<ceres::SubsetManifold>> fixed;
  std::unique_ptr<ceres::Problem> problem;
  std::vector<ParameterBlock*> used;  // those with numbers

  CeresProblem(const FitProblem& p, double robust_scale);
  // Ceres steps freely, since its own bounds cut a step short one number at a time and shrink the region for dozens of iterations. The
  // estimate that ends farthest outside its range is then held at its bound, and the rest solved anew. False: all are inside.
  bool hold_the_farthest_outside(const FitProblem& p);
  void release();  // for the covariance, to which every estimate belongs

 private:
  std::map<ParameterBlock*, std::vector<int>> held;
  void add_flight(CeresFlight& f);
  void add_prior(ParameterBlock& b);
  void add_joint_prior(const JointPrior& prior);
};

CeresProblem::CeresProblem(const FitProblem& p, double robust_scale) : unknowns(make_unknowns(p)) {
  ceres::Problem::Options options;
  options.manifold_ownership = options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.evaluation_callback = &renew;
  problem = std::make_unique<ceres::Problem>(options);
  if (robust_scale > 0.0) loss = std::make_unique<ceres::CauchyLoss>(robust_scale);

  const auto use = [&](ParameterBlock& b) {
    if (b.column.empty()) return;
    used.push_back(&b);
    problem->AddParameterBlock(b.number.data(), static_cast<int>(b.number.size()));
    add_prior(b);
  };
  use(unknowns->shared);
  for (const JointPrior& prior : p.priors) add_joint_prior(prior);
  for (ParameterBlock& b : unknowns->own) use(b);
  for (std::size_t i = 0; i < p.flights.size(); ++i) {
    ModelValues values = p.start;
    values.values = start_values(p, i);
    std::vector<ParameterBlock*> blocks;
    for (ParameterBlock* b : {&unknowns->shared, &unknowns->own[i]}) {
      if (!b->column.empty()) blocks.push_back(b);
      for (std::size_t k = 0; k < b->column.size(); ++k) values[unknowns->columns[b->column[k]]] = b->value(k);
    }
    flights.push_back(std::make_unique<CeresFlight>(*p.flights[i], values, p.flight_noise.empty() ? p.noise : p.flight_noise[i],
                                                    unknowns->columns, blocks));
    add_flight(*flights.back());
  }
}

void CeresProblem::add_prior(ParameterBlock& b) {
  std::vector<double> u(b.column.size());
  bool any = false;
  for (std::size_t i = 0; i < unknowns->places.size(); ++i) {
    if (unknowns->places[i].block != &b) continue;
    u[unknowns->places[i].at] = unknowns->prior_u[i];
    any = any || unknowns->prior_u[i] > 0.0;
  }
  if (any) problem->AddResidualBlock(prior_cost(b, u), nullptr, b.number.data());
}

// Of shared parameters, as the own solver has them: what is not free counts as known. In units of the block's numbers.
void CeresProblem::add_joint_prior(const JointPrior& prior) {
  ParameterBlock& b = unknowns->shared;
  const auto width = static_cast<Eigen::Index>(b.number.size());
  Eigen::MatrixXd from = Eigen::MatrixXd::Zero(prior.information.rows(), width);  // of the prior's parameters, their places in the block
  ceres::Vector mean = ceres::Vector::Zero(width);
  for (std::size_t k = 0; k < prior.parameters.size(); ++k) {
    for (std::size_t i = 0; i < b.column.size(); ++i) {
      if (unknowns->columns[b.column[i]] != prior.parameters[k]) continue;
      const auto of = static_cast<Eigen::Index>(k), at = static_cast<Eigen::Index>(i);
      from(of, at) = b.scale[i];
      mean[at] = prior.mean[of] / b.scale[i];
    }
  }
  const SymmetricEigen eig = symmetric_eigen(prior.weight * from.transpose() * prior.information * from);
  const ceres::Matrix root = eig.values.cwiseMax(0.0).cwiseSqrt().asDiagonal() * eig.vectors.transpose();
  if (root.squaredNorm() > 0.0) problem->AddResidualBlock(new ceres::NormalPrior(root, mean), nullptr, b.number.data());
}

void CeresProblem::add_flight(CeresFlight& f) {
  const GridFlight& g = f.flight();
  const auto add = [&](ceres::CostFunction* cost, ceres::LossFunction* with, std::vector<std::size_t> nodes, bool parameters = true) {
    std::vector<double*> blocks;
    for (const std::size_t k : nodes) blocks.push_back(f.states[k].data());
    for (ParameterBlock* b : f.blocks()) {
      if (parameters) blocks.push_back(b->number.data());
    }
    problem->AddResidualBlock(cost, with, blocks);
    for (const std::size_t k : nodes) {
      if (!problem->HasManifold(f.states[k].data())) problem->SetManifold(f.states[k].data(), &manifold);
    }
  };
  const auto add_all = [&](const std::vector<VectorFix>& list, VectorResidual residual) {
    for (const VectorFix& fix : list) add(vector_cost(f, fix, residual), nullptr, {fix.node});
  };
  for (std::size_t k = 0; k < g.nodes; ++k) {
    const bool begins = k == 0 || !g.linked[k - 1];
    if (begins && g.anchor.squaredNorm() > 0.0) add(anchor_cost(f, k), nullptr, {k}, false);
    if (k + 1 < g.nodes && g.linked[k]) add(process_cost(f, k), nullptr, {k, k + 1});
  }
  for (const PoseFix& fix : g.pose) add(pose_cost(f, fix), loss.get(), {fix.node});
  add_all(g.position, &Residuals::position);
  add_all(g.velocity, &Residuals::velocity);
  add_all(g.gyro, &Residuals::gyro);
  add_all(g.accel, &Residuals::accel);
}

bool CeresProblem::hold_the_farthest_outside(const FitProblem& p) {
  const Place* farthest = nullptr;
  Excess most;
  for (const Place& place : unknowns->places) {
    if (const Excess e = excess_of(p, *unknowns, place); e.by > most.by) {
      most = e;
      farthest = &place;
    }
  }
  if (!farthest) return false;
  ParameterBlock& b = *farthest->block;
  b.number[farthest->at] = most.nearest / b.scale[farthest->at];
  std::vector<int>& places = held[&b];
  places.push_back(static_cast<int>(farthest->at));
  if (places.size() == b.number.size()) {
    problem->SetParameterBlockConstant(b.number.data());
  } else {
    fixed.push_back(std::make_unique<ceres::SubsetManifold>(static_cast<int>(b.number.size()), places));
    problem->SetManifold(b.number.data(), fixed.back().get());
  }
  return true;
}

void CeresProblem::release() {
  for (const auto& [block, places] : held) {
    problem->SetManifold(block->number.data(), nullptr);
    problem->SetParameterBlockVariable(block->number.data());
  }
}

// Ends where fit() ends: when a step lowers the cost by less than the tolerance.
class Watch final : public ceres::IterationCallback {
 public:
  Watch(double tolerance, StopFit stop, const std::function<void(const FitProgress&)>& progress)
      : tolerance_(tolerance), stop_(stop), progress_(progress) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& s) override {
    if (progress_) progress_({s.iteration, s.cost, std::fabs(s.cost_change), 0});
    if (stop_.asked_at_iteration()) return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
    const bool settled = s.iteration > 0 && s.step_is_successful && std::fabs(s.cost_change) < tolerance_;
    return settled ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  double tolerance_;
  StopFit stop_;
  const std::function<void(const FitProgress&)>& progress_;
};

// Of all estimates, in their order and units.
Eigen::MatrixXd parameter_covariance(const FitProblem& p, CeresProblem& c) {
  const auto n = static_cast<Eigen::Index>(c.unknowns->estimates.size());
  Eigen::MatrixXd out(n, n);
  if (n == 0) return out;
  ceres::Covariance covariance{ceres::Covariance::Options()};
  std::vector<const double*> blocks;
  int width = 0;
  for (const ParameterBlock* b : c.used) {
    blocks.push_back(b->number.data());
    width += static_cast<int>(b->number.size());
  }
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> all(width, width);
  if (!covariance.Compute(blocks, c.problem.get()) || !covariance.GetCovarianceMatrix(blocks, all.data())) {
    fail(p, "Ceres finds the Jacobian rank deficient", "some direction of the parameters leaves every residual unchanged",
         "fit with the own solver, which names the directions, and hold one of each at a measured value");
  }
  std::vector<Eigen::Index> row;
  std::vector<double> scale;
  for (const Place& place : c.unknowns->places) {
    Eigen::Index first = 0;
    for (const ParameterBlock* b : c.used) {
      if (b == place.block) break;
      first += static_cast<Eigen::Index>(b->number.size());
    }
    row.push_back(first + static_cast<Eigen::Index>(place.at));
    scale.push_back(place.block->scale[place.at]);
  }
  for (std::size_t i = 0; i < row.size(); ++i) {
    for (std::size_t j = 0; j < row.size(); ++j)
      out(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = scale[i] * scale[j] * all(row[i], row[j]);
  }
  return out;
}

double degrees_of_freedom(const FitProblem& p, std::size_t estimates) {
  double rows = 0.0;
  for (const GridFlight* g : p.flights) {
    for (const auto linked : g->linked) rows += 12.0 * linked;
    rows += 6.0 * static_cast<double>(g->pose.size());
    rows += 3.0 * static_cast<double>(g->position.size() + g->velocity.size() + g->gyro.size() + g->accel.size());
    rows -= 12.0 * static_cast<double>(g->tied_nodes());
  }
  return rows - static_cast<double>(estimates);
}

void require_start_inside(const FitProblem& p, const Unknowns& u) {
  for (const Place& place : u.places) {
    const Excess e = excess_of(p, u, place);
    if (e.by == 0.0) continue;
    throw Error({p.flights.front()->name,
                 fmt::format("start value of {} is {:g} {}, allowed {:g} to {:g}", e.info.name, place.block->value(place.at), e.info.unit,
                             e.info.min, e.info.max),
                 "the vehicle file, or a guess for what it does not hold", "start from a value inside the range"},
                ExitCode::usage);
  }
}

void read_estimates(const Unknowns& u, Fit& out) {
  const auto n = static_cast<Eigen::Index>(u.estimates.size());
  out.information = n > 0 ? LdltFactor(out.covariance).inverse() : out.covariance;
  out.robust_covariance = Eigen::MatrixXd::Constant(n, n, std::numeric_limits<double>::quiet_NaN());
  out.estimates = u.estimates;
  for (std::size_t i = 0; i < out.estimates.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const double prior_u = u.prior_u[i], weight = prior_u > 0.0 ? 1.0 / (prior_u * prior_u) : 0.0;
    Estimate& e = out.estimates[i];
    e.value = u.places[i].block->value(u.places[i].at);
    e.u = std::sqrt(out.covariance(at, at));
    e.u_robust = std::numeric_limits<double>::quiet_NaN();
    e.prior_share = weight * out.covariance(at, at);
    out.information(at, at) -= weight;
  }
}

}  // namespace

Fit fit_with_ceres(const FitProblem& p, const FitOptions& o, const std::function<void(const FitProgress&)>& progress) {
  if (o.noise.rounds > 0) {
    throw Error({"identify", "Ceres solves for states and parameters with the noise given; it has no EM for the noise",
                 "--solver ceres together with an estimated noise", "estimate the noise with the own solver and give it to this one"},
                ExitCode::usage);
  }
  CeresProblem c(p, o.robust_scale);
  require_start_inside(p, *c.unknowns);
  Watch watch(o.tolerance, o.stop, progress);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = o.max_iterations;
  options.num_threads = 1;  // Residuals keep a hint of the last place in the rotor log
  options.initial_trust_region_radius = kFirstRegion;
  options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 0.0;  // the watch ends it
  options.logging_type = ceres::SILENT;
  options.callbacks.push_back(&watch);
  ceres::Solver::Summary summary;
  Fit out;
  do {
    ceres::Solve(options, c.problem.get(), &summary);
    if (!summary.IsSolutionUsable()) {
      fail(p, "Ceres cannot go on: " + summary.message, "measurements or rotor speeds that are not finite",
           "check the log (`rotorloop log info`) and the start values");
    }
    out.iterations += static_cast<int>(summary.iterations.size()) - 1;
  } while (!o.stop.asked() && c.hold_the_farthest_outside(p));
  c.release();

  out.covariance = parameter_covariance(p, c);
  read_estimates(*c.unknowns, out);
  for (const auto& f : c.flights) {
    f->renew();
    out.values.push_back(f->values());
    std::vector<BodyState>& states = out.states.emplace_back();
    for (const StateBlock& b : f->states) states.push_back(from_block(b.data()));
  }
  out.noise = p.flight_noise.empty() ? std::vector<NoiseModel>(p.flights.size(), p.noise) : p.flight_noise;
  out.cost = summary.final_cost;
  out.degrees_of_freedom = degrees_of_freedom(p, out.estimates.size());
  out.log_likelihood = std::numeric_limits<double>::quiet_NaN();
  out.converged = !o.stop.asked() && (summary.termination_type == ceres::CONVERGENCE || summary.termination_type == ceres::USER_SUCCESS);
  return out;
}

}  // namespace rotorloop::estimate
