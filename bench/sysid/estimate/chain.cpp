#include "bench/sysid/estimate/chain.hpp"

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <stdexcept>

namespace rotorloop::estimate {
namespace {

using Arrow = Eigen::Matrix<double, 12, Eigen::Dynamic, Eigen::ColMajor, 12, kMaxColumns + 1>;

// Cauchy loss of a block with sum of squares s: cost ½ c² log(1 + s/c²), weight 1/(1 + s/c²) on its rows.
double robust_cost(double s, double c) { return c > 0.0 ? 0.5 * c * c * std::log1p(s / (c * c)) : 0.5 * s; }
double robust_weight(double s, double c) { return c > 0.0 ? 1.0 / (1.0 + s / (c * c)) : 1.0; }

// The streams of vector measurements, in the order in which their rows are added.
struct VectorStream {
  std::vector<VectorFix> GridFlight::*fixes;
  std::vector<LinearRows::Measurement<3>> LinearRows::*rows;
  void (Residuals::*residual)(const VectorFix&, const BodyState&, RowsBy<3>&, bool) const;
};
constexpr std::array<VectorStream, 4> kVectorStreams{{{&GridFlight::position, &LinearRows::position, &Residuals::position},
                                                      {&GridFlight::velocity, &LinearRows::velocity, &Residuals::velocity},
                                                      {&GridFlight::gyro, &LinearRows::gyro, &Residuals::gyro},
                                                      {&GridFlight::accel, &LinearRows::accel, &Residuals::accel}}};

// Positions in the lists of measurements while the nodes are walked upwards.
class MeasurementCursor {
 public:
  template <class Act>
  void poses(const GridFlight& g, std::size_t node, Act&& act) {
    for (; pose_ < g.pose.size() && g.pose[pose_].node == node; ++pose_) act(g.pose[pose_]);
  }
  template <class Act>
  void vectors(const GridFlight& g, std::size_t node, Act&& act) {
    for (std::size_t s = 0; s < kVectorStreams.size(); ++s) {
      const std::vector<VectorFix>& list = g.*kVectorStreams[s].fixes;
      for (std::size_t& i = vector_[s]; i < list.size() && list[i].node == node; ++i) act(kVectorStreams[s], list[i]);
    }
  }

 private:
  std::size_t pose_ = 0;
  std::array<std::size_t, kVectorStreams.size()> vector_{};
};

// The forward sweep. At each node: the rows that act on its state are added to its blocks of the normal equations, the state is
// eliminated, and what it leaves goes to the next node.
class Elimination {
 public:
  // All kept by reference; `rows` are kept when it is not null.
  Elimination(const GridFlight& flight, const std::vector<BodyState>& states, const std::vector<BodyState>& guess,
              const Residuals& residuals, const SweepOptions& options, LinearRows* rows);
  // keep(node, L, Y, [Z y]) at each node.
  template <class Keep>
  Reduced run(Keep&& keep);

 private:
  template <class State, class Columns, class R>
  void add(const State& state, const Columns& columns, const R& r);
  void add_anchor(std::size_t k);
  void add_pose(std::size_t k, const PoseFix& fix);
  void add_measurements(std::size_t k);
  void add_process(std::size_t k);
  Eigen::LLT<StateJacobian> eliminate();
  void pass_on();
  void predict(const PoseFix& fix, std::size_t k);
  void end_score_block(std::size_t k);

  const GridFlight& flight_;
  const std::vector<BodyState>&states_, &guess_;
  const Residuals& residuals_;
  const SweepOptions& options_;
  LinearRows* rows_;
  const Eigen::Index p_;  // columns

  // Blocks of the normal matrix: D, E (then Y) and [C g] of the node, D and [C g] of the next, as far as they are summed; [Z y].
  StateJacobian d_ = StateJacobian::Zero(), e_, d_next_ = StateJacobian::Zero();
  Arrow b_, b_next_, z_;
  Eigen::MatrixXd total_;      // of [J r]ᵀ[J r], then minus [Z y]ᵀ[Z y]
  double squares_ = 0.0;       // Σ r²
  double explained_ = 0.0;     // Σ yᵀy
  double robust_extra_ = 0.0;  // cost that is not ½ r²
  Reduced out_;

  MeasurementCursor cursor_;
  RowsBy<6> six_;
  RowsBy<3> three_;
  ProcessRows step_;
  bool linked_ = false;       // the node, to the next
  std::size_t settled_;       // nodes until the past fixes a state
  std::size_t in_piece_ = 0;  // nodes since the piece began
  double block_from_s_;       // of the score block under way
  Eigen::MatrixXd block_before_;
};

Elimination::Elimination(const GridFlight& flight, const std::vector<BodyState>& states, const std::vector<BodyState>& guess,
                         const Residuals& residuals, const SweepOptions& options, LinearRows* rows)
    : flight_(flight),
      states_(states),
      guess_(guess),
      residuals_(residuals),
      options_(options),
      rows_(rows),
      p_(residuals.width()),
      b_(Arrow::Zero(12, p_ + 1)),
      b_next_(Arrow::Zero(12, p_ + 1)),
      z_(12, p_ + 1),
      total_(Eigen::MatrixXd::Zero(p_ + 1, p_ + 1)),
      settled_(static_cast<std::size_t>(std::ceil(0.25 / flight_.step_s))),
      block_from_s_(flight_.start_s),
      block_before_(Eigen::MatrixXd::Zero(p_ + 1, p_ + 1)) {}

template <class Keep>
Reduced Elimination::run(Keep&& keep) {
  for (std::size_t k = 0; k < flight_.nodes; ++k) {
    if (flight_.begins(k)) in_piece_ = 0;
    add_anchor(k);
    add_measurements(k);
    add_process(k);
    const Eigen::LLT<StateJacobian> llt = eliminate();
    keep(k, llt.matrixLLT(), e_, z_);
    pass_on();
    ++in_piece_;
    end_score_block(k);
  }
  out_.information = total_.topLeftCorner(p_, p_);
  out_.score = total_.col(p_).head(p_);
  out_.cost = 0.5 * squares_ + robust_extra_;
  out_.predicted_cost = out_.cost - 0.5 * explained_;
  return std::move(out_);
}

// Rows by the state of the node and by the columns, and their residuals.
template <class State, class Columns, class R>
void Elimination::add(const State& state, const Columns& columns, const R& r) {
  d_.noalias() += state.transpose() * state;
  b_.leftCols(p_).noalias() += state.transpose() * columns;
  b_.col(p_).noalias() += state.transpose() * r;
  total_.topLeftCorner(p_, p_).noalias() += columns.transpose() * columns;
  total_.col(p_).head(p_).noalias() += columns.transpose() * r;
  squares_ += r.squaredNorm();
  out_.residuals += static_cast<std::size_t>(r.size());
}

void Elimination::add_anchor(std::size_t k) {
  if (!flight_.begins(k) || !(flight_.anchor.squaredNorm() > 0.0)) return;
  StateJacobian by;
  const StateError r = residuals_.anchor(guess_[k], states_[k], by);
  if (rows_) rows_->anchors.push_back({by, r});
  d_.noalias() += by.transpose() * by;
  b_.col(p_).noalias() += by.transpose() * r;
  squares_ += r.squaredNorm();
}

void Elimination::add_measurements(std::size_t k) {
  cursor_.poses(flight_, k, [&](const PoseFix& fix) { add_pose(k, fix); });
  cursor_.vectors(flight_, k, [&](const VectorStream& stream, const VectorFix& fix) {
    (residuals_.*stream.residual)(fix, states_[k], three_, true);
    if (rows_) (rows_->*stream.rows).push_back({three_.state, three_.r});
    add(three_.state, three_.columns, three_.r);
  });
}

void Elimination::add_pose(std::size_t k, const PoseFix& fix) {
  residuals_.pose(fix, states_[k], six_, true);
  if (options_.innovations && in_piece_ > settled_) predict(fix, k);
  const double s = six_.r.squaredNorm(), weight = robust_weight(s, options_.robust_scale);
  if (weight != 1.0) {
    robust_extra_ += robust_cost(s, options_.robust_scale) - 0.5 * weight * s;
    const double root = std::sqrt(weight);
    six_.r *= root;
    six_.state *= root;
    six_.columns *= root;
  }
  if (rows_) rows_->pose.push_back({six_.state, six_.r, weight});
  add(six_.state, six_.columns, six_.r);
}

// The past alone says x + δ with δ = -D⁻¹g, covariance D⁻¹.
void Elimination::predict(const PoseFix& fix, std::size_t k) {
  const Eigen::LLT<StateJacobian> past(d_);
  if (past.info() != Eigen::Success) return;
  const Eigen::Matrix<double, 6, 1> ahead = six_.r - six_.state * past.solve(b_.col(p_));
  const Eigen::Matrix<double, 6, 6> cov = Eigen::Matrix<double, 6, 6>::Identity() + six_.state * past.solve(six_.state.transpose());
  const Eigen::LLT<Eigen::Matrix<double, 6, 6>> factor(cov);
  out_.innovations.push_back({flight_.time_s(k) + fix.late_s, factor.matrixL().solve(ahead), factor.matrixL()});
}

void Elimination::add_process(std::size_t k) {
  linked_ = k + 1 < flight_.nodes && flight_.linked[k];
  e_.setZero();
  d_next_.setZero();
  b_next_.setZero();
  if (!linked_) return;
  residuals_.process(k, states_[k], states_[k + 1], step_);
  if (rows_) rows_->steps[k] = {step_.from, step_.to, step_.r};
  add(step_.from, step_.columns, step_.r);
  e_.noalias() = step_.from.transpose() * step_.to;
  d_next_.noalias() = step_.to.transpose() * step_.to;
  b_next_.leftCols(p_).noalias() = step_.to.transpose() * step_.columns;
  b_next_.col(p_).noalias() = step_.to.transpose() * step_.r;
}

Eigen::LLT<StateJacobian> Elimination::eliminate() {
  if (d_.diagonal().maxCoeff() == 0.0) d_.setIdentity();  // a node of a dropped piece: nothing is known, nothing is asked
  if (options_.damping > 0.0) d_.diagonal() *= 1.0 + options_.damping;
  const Eigen::LLT<StateJacobian> llt(d_);
  if (llt.info() != Eigen::Success) throw std::domain_error("the information of a state is not positive definite");
  const auto l = llt.matrixL();
  for (Eigen::Index i = 0; i < 12; ++i) out_.log_det_states += 2.0 * std::log(llt.matrixLLT()(i, i));
  z_ = l.solve(b_);
  e_ = l.solve(e_);  // now Y
  total_.noalias() -= z_.transpose() * z_;
  explained_ += z_.col(p_).squaredNorm();
  return llt;
}

void Elimination::pass_on() {
  d_ = d_next_;
  b_ = b_next_;
  if (!linked_) return;
  d_.noalias() -= e_.transpose() * e_;
  b_.noalias() -= e_.transpose() * z_;
}

// The state at the block's end, known from its past only, is eliminated too: otherwise it would stay pinned at the value that the whole
// flight gives it.
void Elimination::end_score_block(std::size_t k) {
  const double now_s = flight_.time_s(k);
  if (options_.block_s <= 0.0 || (k + 1 < flight_.nodes && now_s - block_from_s_ < options_.block_s)) return;
  Eigen::MatrixXd sums = total_;
  if (linked_) {
    const Eigen::LLT<StateJacobian> past(d_);
    if (past.info() == Eigen::Success) {
      const Arrow t = past.matrixL().solve(b_);
      sums.noalias() -= t.transpose() * t;
    }
  }
  const Eigen::MatrixXd change = sums - block_before_;
  out_.blocks.push_back({block_from_s_, now_s, change.topLeftCorner(p_, p_), change.col(p_).head(p_)});
  block_before_ = sums;
  block_from_s_ = now_s;
}

}  // namespace

Chain::Chain(const GridFlight& flight, std::vector<BodyState>& states, const std::vector<BodyState>& guess)
    : flight_(flight), states_(states), guess_(guess) {}

double Chain::cost(const Residuals& res, double robust_scale) const {
  double sum = 0.0;
  MeasurementCursor at;
  RowsBy<6> six;
  RowsBy<3> three;
  const bool anchored = flight_.anchor.squaredNorm() > 0.0;
  StateJacobian unused;
  for (std::size_t k = 0; k < flight_.nodes; ++k) {
    const BodyState& x = states_[k];
    if (anchored && flight_.begins(k)) sum += 0.5 * res.anchor(guess_[k], x, unused).squaredNorm();
    at.poses(flight_, k, [&](const PoseFix& f) {
      res.pose(f, x, six, false);
      sum += robust_cost(six.r.squaredNorm(), robust_scale);
    });
    at.vectors(flight_, k, [&](const VectorStream& stream, const VectorFix& f) {
      (res.*stream.residual)(f, x, three, false);
      sum += 0.5 * three.r.squaredNorm();
    });
    if (k + 1 < flight_.nodes && flight_.linked[k]) sum += 0.5 * res.process(k, x, states_[k + 1]).squaredNorm();
  }
  return sum;
}

Reduced Chain::sweep(const Residuals& res, const SweepOptions& o) {
  columns_ = res.width();
  if (o.keep_factors) {
    factors_.resize(flight_.nodes);
    arrow_.resize(flight_.nodes * 12 * static_cast<std::size_t>(columns_ + 1));
  }
  rows_ = {};
  rows_.steps.resize(o.keep_rows ? flight_.nodes : 0);
  return Elimination(flight_, states_, guess_, res, o, o.keep_rows ? &rows_ : nullptr)
      .run([&](std::size_t k, const auto& l, const auto& y, const auto& z) {
        if (!o.keep_factors) return;
        factors_[k] = {l, y};
        Eigen::Map<Arrow>(&arrow_[k * 12 * static_cast<std::size_t>(columns_ + 1)], 12, columns_ + 1) = z;
      });
}

void Chain::apply(const Eigen::VectorXd& parameter_step, double share) {
  Eigen::VectorXd with(columns_ + 1);
  with << parameter_step, 1.0;
  StateError next = StateError::Zero();
  for (std::size_t k = flight_.nodes; k-- > 0;) {
    const Eigen::Map<const Arrow> z(&arrow_[k * 12 * static_cast<std::size_t>(columns_ + 1)], 12, columns_ + 1);
    const StateError rhs = -(z * with) - factors_[k].y * next;
    next = factors_[k].l.triangularView<Eigen::Lower>().transpose().solve(rhs);
    states_[k] = moved(states_[k], share * next);
  }
}

void Chain::move(const std::vector<StateError>& by) {
  for (std::size_t k = 0; k < flight_.nodes; ++k) states_[k] = moved(states_[k], by[k]);
}

const LinearRows& Chain::rows_here(const Residuals& res) {
  RowsBy<6> six;
  RowsBy<3> three;
  StateJacobian unused;
  std::size_t anchor = 0;
  for (std::size_t k = 0; k < flight_.nodes; ++k) {
    if (!rows_.anchors.empty() && flight_.begins(k)) rows_.anchors[anchor++].r = res.anchor(guess_[k], states_[k], unused);
    if (k + 1 < flight_.nodes && flight_.linked[k]) rows_.steps[k].r = res.process(k, states_[k], states_[k + 1]);
  }
  for (std::size_t i = 0; i < flight_.pose.size(); ++i) {
    res.pose(flight_.pose[i], states_[flight_.pose[i].node], six, false);
    rows_.pose[i].r = std::sqrt(rows_.pose[i].weight) * six.r;
  }
  for (const VectorStream& stream : kVectorStreams) {
    const std::vector<VectorFix>& list = flight_.*stream.fixes;
    for (std::size_t i = 0; i < list.size(); ++i) {
      (res.*stream.residual)(list[i], states_[list[i].node], three, false);
      (rows_.*stream.rows)[i].r = three.r;
    }
  }
  return rows_;
}

}  // namespace rotorloop::estimate
