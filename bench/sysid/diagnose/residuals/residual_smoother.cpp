#include "bench/sysid/diagnose/residuals/residual_smoother.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <stdexcept>

namespace rotorloop::diagnose {
namespace {

bool begins(const LinearFlight& f, std::size_t k) { return k == 0 || !f.linked[k - 1]; }

// What whitens a step's error; the same for every step of a flight: a unit error of each kind is put behind one of them.
estimate::StateJacobian step_whitening(const estimate::GridFlight& g, const estimate::ModelValues& values, const estimate::Residuals& res,
                                       const std::vector<estimate::BodyState>& states) {
  estimate::StateJacobian w = estimate::StateJacobian::Identity();
  const auto first = std::find(g.linked.begin(), g.linked.end(), 1);
  if (first == g.linked.end()) return w;
  const auto k = static_cast<std::size_t>(first - g.linked.begin());
  estimate::RotorInput input = g.input;
  input.prepare(values);
  std::size_t hint = 0;
  const estimate::BodyState predicted = estimate::Model(values).step(states[k], input, hint, g.time_s(k), g.time_s(k + 1), g.substeps);
  for (Eigen::Index i = 0; i < 12; ++i) w.col(i) = res.process(k, states[k], estimate::moved(predicted, estimate::StateError::Unit(i)));
  return w;
}

}  // namespace

LinearFlight linearised(const estimate::GridFlight& g, const estimate::ModelValues& values, const estimate::NoiseModel& noise,
                        const std::vector<estimate::BodyState>& states) {
  const estimate::Residuals res(g, values, noise, {estimate::kPoseDelay});
  LinearFlight out;
  out.nodes = g.nodes;
  out.linked = g.linked;
  out.whitening = step_whitening(g, values, res, states);
  out.anchor = g.anchor;
  out.steps.resize(g.nodes > 0 ? g.nodes - 1 : 0);
  estimate::ProcessRows step;
  for (std::size_t k = 0; k < out.steps.size(); ++k) {
    out.steps[k] = {estimate::StateJacobian::Zero(), estimate::StateJacobian::Zero(), estimate::StateError::Zero()};
    if (!g.linked[k]) continue;
    res.process(k, states[k], states[k + 1], step);
    out.steps[k] = {step.from, step.to, step.r};
  }
  estimate::RowsBy<6> six;
  estimate::RowsBy<3> three;
  for (const estimate::PoseFix& f : g.pose) {
    res.pose(f, states[f.node], six, true);
    out.measurements.push_back({LinearFlight::Kind::pose, f.node, g.time_s(f.node) + f.late_s, 6, six.state, six.r, six.columns.col(0)});
  }
  const auto vectors = [&](const std::vector<estimate::VectorFix>& list, LinearFlight::Kind kind, auto&& rows) {
    for (const estimate::VectorFix& f : list) {
      rows(f);
      LinearFlight::Measurement r;
      r.kind = kind;
      r.node = f.node;
      r.t_s = g.time_s(f.node) + f.late_s;
      r.rows = 3;
      r.state.setZero();
      r.r.setZero();
      r.state.topRows<3>() = three.state;
      r.r.head<3>() = three.r;
      out.measurements.push_back(r);
    }
  };
  vectors(g.position, LinearFlight::Kind::position, [&](const estimate::VectorFix& f) { res.position(f, states[f.node], three, true); });
  vectors(g.velocity, LinearFlight::Kind::velocity, [&](const estimate::VectorFix& f) { res.velocity(f, states[f.node], three, true); });
  vectors(g.gyro, LinearFlight::Kind::gyro, [&](const estimate::VectorFix& f) { res.gyro(f, states[f.node], three, true); });
  vectors(g.accel, LinearFlight::Kind::accel, [&](const estimate::VectorFix& f) { res.accel(f, states[f.node], three, true); });
  std::stable_sort(out.measurements.begin(), out.measurements.end(),
                   [](const LinearFlight::Measurement& a, const LinearFlight::Measurement& b) { return a.node < b.node; });
  return out;
}

ResidualColumns ResidualColumns::zero(const LinearFlight& f, Eigen::Index columns) {
  return {Eigen::MatrixXd::Zero(12 * static_cast<Eigen::Index>(f.steps.size()), columns),
          Eigen::MatrixXd::Zero(6 * static_cast<Eigen::Index>(f.measurements.size()), columns)};
}

ResidualSmoother::ResidualSmoother(const LinearFlight& f, double process_scale) : flight_(f), scale_(process_scale) {
  l_.resize(f.nodes);
  y_.resize(f.nodes);
  const double weight = 1.0 / scale_;
  estimate::StateJacobian d = estimate::StateJacobian::Zero(), e;
  std::size_t measurement = 0;
  for (std::size_t k = 0; k < f.nodes; ++k) {
    if (begins(f, k)) {
      for (Eigen::Index i = 0; i < 12; ++i) {
        if (f.anchor[i] > 0.0) d(i, i) += 1.0 / (f.anchor[i] * f.anchor[i]);
      }
    }
    for (; measurement < f.measurements.size() && f.measurements[measurement].node == k; ++measurement)
      d.noalias() += f.measurements[measurement].state.transpose() * f.measurements[measurement].state;
    const bool linked = k + 1 < f.nodes && f.linked[k];
    e.setZero();
    if (linked) {
      d.noalias() += weight * f.steps[k].from.transpose() * f.steps[k].from;
      e.noalias() = weight * f.steps[k].from.transpose() * f.steps[k].to;
    }
    if (d.diagonal().maxCoeff() == 0.0) d.setIdentity();  // a node of a dropped piece: nothing is known, nothing is asked
    const Eigen::LLT<estimate::StateJacobian> llt(d);
    if (llt.info() != Eigen::Success) throw std::domain_error("the information of a state is not positive definite");
    l_[k] = llt.matrixLLT();
    y_[k] = llt.matrixL().solve(e);
    d.setZero();
    if (linked) {
      d.noalias() = weight * f.steps[k].to.transpose() * f.steps[k].to;
      d.noalias() -= y_[k].transpose() * y_[k];
    }
  }
}

ResidualColumns ResidualSmoother::smoothed(const ResidualColumns& in) const {
  const LinearFlight& f = flight_;
  const Eigen::Index columns = in.steps.cols();
  const double weight = 1.0 / scale_;
  Eigen::MatrixXd move(12 * static_cast<Eigen::Index>(f.nodes), columns);  // first y, then the states' steps
  Eigen::MatrixXd g = Eigen::MatrixXd::Zero(12, columns);
  const auto at = [&](std::size_t k) { return move.middleRows<12>(12 * static_cast<Eigen::Index>(k)); };
  std::size_t measurement = 0;
  for (std::size_t k = 0; k < f.nodes; ++k) {
    for (; measurement < f.measurements.size() && f.measurements[measurement].node == k; ++measurement)
      g.noalias() += f.measurements[measurement].state.transpose() * in.measurement(measurement);
    const bool linked = k + 1 < f.nodes && f.linked[k];
    if (linked) g.noalias() += weight * f.steps[k].from.transpose() * in.step(k);
    at(k) = l_[k].triangularView<Eigen::Lower>().solve(g);
    g.setZero();
    if (!linked) continue;
    g.noalias() = weight * f.steps[k].to.transpose() * in.step(k);
    g.noalias() -= y_[k].transpose() * at(k);
  }
  ResidualColumns out = in;
  for (std::size_t k = f.nodes; k-- > 0;) {
    Eigen::MatrixXd rhs = -at(k);
    const bool linked = k + 1 < f.nodes && f.linked[k];
    if (linked) rhs.noalias() -= y_[k] * at(k + 1);
    at(k) = l_[k].triangularView<Eigen::Lower>().transpose().solve(rhs);
    if (!linked) continue;
    out.step(k).noalias() += f.steps[k].from * at(k);
    out.step(k).noalias() += f.steps[k].to * at(k + 1);
  }
  for (std::size_t i = 0; i < f.measurements.size(); ++i)
    out.measurement(i).noalias() += f.measurements[i].state * at(f.measurements[i].node);
  return out;
}

estimate::StateJacobian ResidualSmoother::marginal(std::size_t k, const estimate::StateJacobian& next) const {
  const auto l = l_[k].triangularView<Eigen::Lower>();
  const estimate::StateJacobian middle = estimate::StateJacobian::Identity() + y_[k] * next * y_[k].transpose();
  const estimate::StateJacobian half = l.transpose().solve(middle);
  return l.transpose().solve(half.transpose());
}

estimate::StateJacobian ResidualSmoother::joint(std::size_t k, const estimate::StateJacobian& next) const {
  return -(l_[k].triangularView<Eigen::Lower>().transpose().solve(y_[k] * next));
}

}  // namespace rotorloop::diagnose
