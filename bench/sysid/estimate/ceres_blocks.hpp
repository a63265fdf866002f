// The unknowns and residuals of the fit in Ceres's form: the same rows and derivatives (class Residuals) as the own elimination
// reads, everything after them (retraction of attitudes, ordering, factorisation, damping, covariance) Ceres's own.
// A state is a block of 13 numbers: p, v in W, q (x, y, z, w), Ω in B. Parameters are blocks in units of their scale.
#pragma once
#include <ceres/cost_function.h>
#include <ceres/evaluation_callback.h>

#include <array>
#include <memory>
#include <vector>

#include "bench/sysid/estimate/residuals.hpp"

namespace rotorloop::estimate {

inline constexpr int kStateBlock = 13;
using StateBlock = std::array<double, kStateBlock>;
StateBlock to_block(const BodyState& x);
BodyState from_block(const double* block);

// Parameters that are unknowns together: those that all flights share, or one flight's own.
struct ParameterBlock {
  std::vector<std::size_t> column;  // of the problem's columns, which are the same for every flight
  std::vector<double> scale;        // value = scale * number in the block
  std::vector<double> number;

  double value(std::size_t i) const { return scale[i] * number[i]; }
};

// One flight's unknowns and its residuals at the values that Ceres holds at the moment.
class CeresFlight {
 public:
  // `blocks`: the parameter blocks that this flight depends on, kept by reference. `values`: everything that is not free.
  CeresFlight(const GridFlight& flight, const ModelValues& values, const NoiseModel& noise, const Columns& columns,
              std::vector<ParameterBlock*> blocks);

  void renew();                                               // from the numbers in the blocks
  const Residuals& residuals() const { return *residuals_; }  // of the last renew()
  const ModelValues& values() const { return values_; }
  const GridFlight& flight() const { return flight_; }
  const std::vector<ParameterBlock*>& blocks() const { return blocks_; }

  const std::vector<BodyState> guess;
  std::vector<StateBlock> states;

 private:
  const GridFlight& flight_;
  ModelValues values_;
  NoiseModel noise_;
  Columns columns_;
  std::vector<ParameterBlock*> blocks_;
  std::unique_ptr<Residuals> residuals_;
};

// Makes the residuals of all flights anew when Ceres moves to other values.
class RenewFlights final : public ceres::EvaluationCallback {
 public:
  explicit RenewFlights(std::vector<std::unique_ptr<CeresFlight>>& flights) : flights_(flights) {}
  void PrepareForEvaluation(bool derivatives, bool new_point) override;

 private:
  std::vector<std::unique_ptr<CeresFlight>>& flights_;
};

// Each owned by the caller. Blocks: process {state k, state k + 1, parameter blocks…}, measurements {state, parameter blocks…},
// anchor {state}, prior {parameter block}.
ceres::CostFunction* process_cost(const CeresFlight& flight, std::size_t node);
ceres::CostFunction* pose_cost(const CeresFlight& flight, const PoseFix& fix);
using VectorResidual = void (Residuals::*)(const VectorFix&, const BodyState&, RowsBy<3>&, bool) const;
ceres::CostFunction* vector_cost(const CeresFlight& flight, const VectorFix& fix, VectorResidual residual);
ceres::CostFunction* anchor_cost(const CeresFlight& flight, std::size_t node);
// (number - start) * scale / u for each parameter with u > 0.
ceres::CostFunction* prior_cost(const ParameterBlock& block, const std::vector<double>& u);

}  // namespace rotorloop::estimate
