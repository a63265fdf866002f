#include "bench/sysid/estimate/ceres_blocks.hpp"

#include <algorithm>

namespace rotorloop::estimate {
namespace {

template <int Rows, int Columns>
using RowMajor = Eigen::Map<Eigen::Matrix<double, Rows, Columns, Columns == 1 ? Eigen::ColMajor : Eigen::RowMajor>>;

// δφ of q = q̂ ⊗ (δφ/2, 1) from a change of the four numbers (x, y, z, w), on the sphere: 4 Gᵀ with G = ∂q/∂δφ, as GᵀG = 1/4.
Eigen::Matrix<double, 3, 4> turn_by_numbers(const Eigen::Quaterniond& q) {
  const double x = q.x(), y = q.y(), z = q.z(), w = q.w();
  Eigen::Matrix<double, 3, 4> m;
  m << w, z, -y, -x,  //
      -z, w, x, -y,   //
      y, -x, w, -z;
  return 2.0 * m;
}

// Derivatives by the state error, as derivatives by the 13 numbers.
template <int Rows>
void write_state(const Eigen::Matrix<double, Rows, 12>& by_error, const double* block, double* out) {
  if (!out) return;
  RowMajor<Rows, kStateBlock> j(out);
  j.template leftCols<6>() = by_error.template leftCols<6>();
  j.template middleCols<4>(6).noalias() = by_error.template middleCols<3>(6) * turn_by_numbers(Eigen::Quaterniond(block + 6));
  j.template rightCols<3>() = by_error.template rightCols<3>();
}

template <class Matrix>
void write_parameters(const Matrix& columns, const CeresFlight& flight, double** out) {
  for (std::size_t b = 0; b < flight.blocks().size(); ++b) {
    if (!out[b]) continue;
    const ParameterBlock& block = *flight.blocks()[b];
    const std::size_t width = block.column.size();
    for (Eigen::Index row = 0; row < columns.rows(); ++row) {
      for (std::size_t i = 0; i < width; ++i)
        out[b][static_cast<std::size_t>(row) * width + i] = block.scale[i] * columns(row, static_cast<Eigen::Index>(block.column[i]));
    }
  }
}

// What the residuals of a flight have in common.
class FlightCost : public ceres::CostFunction {
 protected:
  FlightCost(const CeresFlight& flight, int rows, int states) : flight_(flight) {
    set_num_residuals(rows);
    mutable_parameter_block_sizes()->assign(static_cast<std::size_t>(states), kStateBlock);
  }
  void depend_on_parameters() {
    for (const ParameterBlock* b : flight_.blocks()) mutable_parameter_block_sizes()->push_back(static_cast<int>(b->column.size()));
  }
  const CeresFlight& flight_;
};

class ProcessCost final : public FlightCost {
 public:
  ProcessCost(const CeresFlight& flight, std::size_t node) : FlightCost(flight, 12, 2), node_(node) { depend_on_parameters(); }
  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    const BodyState from = from_block(x[0]), to = from_block(x[1]);
    RowMajor<12, 1> r(residuals);
    if (!jacobians) {
      r = flight_.residuals().process(node_, from, to);
    } else {
      ProcessRows rows;
      flight_.residuals().process(node_, from, to, rows);
      r = rows.r;
      write_state<12>(rows.from, x[0], jacobians[0]);
      write_state<12>(rows.to, x[1], jacobians[1]);
      write_parameters(rows.columns, flight_, jacobians + 2);
    }
    return r.allFinite();
  }

 private:
  std::size_t node_;
};

template <int Rows, class Fix>
class MeasurementCost final : public FlightCost {
 public:
  using Residual = void (Residuals::*)(const Fix&, const BodyState&, RowsBy<Rows>&, bool) const;
  MeasurementCost(const CeresFlight& flight, const Fix& fix, Residual residual)
      : FlightCost(flight, Rows, 1), fix_(fix), residual_(residual) {
    depend_on_parameters();
  }
  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    RowsBy<Rows> rows;
    (flight_.residuals().*residual_)(fix_, from_block(x[0]), rows, jacobians != nullptr);
    RowMajor<Rows, 1> r(residuals);
    r = rows.r;
    if (jacobians) {
      write_state<Rows>(rows.state, x[0], jacobians[0]);
      write_parameters(rows.columns, flight_, jacobians + 1);
    }
    return rows.r.allFinite();
  }

 private:
  const Fix& fix_;
  Residual residual_;
};

class AnchorCost final : public FlightCost {
 public:
  AnchorCost(const CeresFlight& flight, std::size_t node) : FlightCost(flight, 12, 1), node_(node) {}
  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    StateJacobian by;
    RowMajor<12, 1> r(residuals);
    r = flight_.residuals().anchor(flight_.guess[node_], from_block(x[0]), by);
    if (jacobians) write_state<12>(by, x[0], jacobians[0]);
    return true;
  }

 private:
  std::size_t node_;
};

class PriorCost final : public ceres::CostFunction {
 public:
  PriorCost(const ParameterBlock& block, const std::vector<double>& u) : start_(block.number) {
    for (std::size_t i = 0; i < u.size(); ++i) {
      if (u[i] > 0.0) rows_.push_back({i, block.scale[i] / u[i]});
    }
    set_num_residuals(static_cast<int>(rows_.size()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(start_.size()));
  }
  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    for (std::size_t k = 0; k < rows_.size(); ++k) residuals[k] = rows_[k].weight * (x[0][rows_[k].place] - start_[rows_[k].place]);
    if (jacobians && jacobians[0]) {
      std::fill_n(jacobians[0], rows_.size() * start_.size(), 0.0);
      for (std::size_t k = 0; k < rows_.size(); ++k) jacobians[0][k * start_.size() + rows_[k].place] = rows_[k].weight;
    }
    return true;
  }

 private:
  struct Row {
    std::size_t place;
    double weight;
  };
  std::vector<double> start_;
  std::vector<Row> rows_;
};

}  // namespace

StateBlock to_block(const BodyState& x) {
  StateBlock b;
  RowMajor<kStateBlock, 1>(b.data()) << x.p_W_m, x.v_W_m_s, x.q_WB.coeffs(), x.w_B_rad_s;
  return b;
}

BodyState from_block(const double* b) {
  using Three = Eigen::Map<const Eigen::Vector3d>;
  return {Three(b), Three(b + 3), Eigen::Quaterniond(b + 6), Three(b + 10)};
}

CeresFlight::CeresFlight(const GridFlight& flight, const ModelValues& values, const NoiseModel& noise, const Columns& columns,
                         std::vector<ParameterBlock*> blocks)
    : guess(guess_states(flight, values)), flight_(flight), values_(values), noise_(noise), columns_(columns), blocks_(std::move(blocks)) {
  for (const BodyState& x : guess) states.push_back(to_block(x));
}

void CeresFlight::renew() {
  for (const ParameterBlock* b : blocks_) {
    for (std::size_t i = 0; i < b->column.size(); ++i) values_[columns_[b->column[i]]] = b->value(i);
  }
  residuals_ = std::make_unique<Residuals>(flight_, values_, noise_, columns_);
}

void RenewFlights::PrepareForEvaluation(bool /*derivatives*/, bool new_point) {
  if (!new_point) return;
  for (auto& f : flights_) f->renew();
}

ceres::CostFunction* process_cost(const CeresFlight& flight, std::size_t node) { return new ProcessCost(flight, node); }
ceres::CostFunction* pose_cost(const CeresFlight& flight, const PoseFix& fix) {
  return new MeasurementCost<6, PoseFix>(flight, fix, &Residuals::pose);
}
ceres::CostFunction* vector_cost(const CeresFlight& flight, const VectorFix& fix, VectorResidual residual) {
  return new MeasurementCost<3, VectorFix>(flight, fix, residual);
}
ceres::CostFunction* anchor_cost(const CeresFlight& flight, std::size_t node) { return new AnchorCost(flight, node); }
ceres::CostFunction* prior_cost(const ParameterBlock& block, const std::vector<double>& u) { return new PriorCost(block, u); }

}  // namespace rotorloop::estimate
