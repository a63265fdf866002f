#include "cli/progress/identify_progress_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli/progress/progress_line.hpp"

namespace rotorloop::cli {
namespace {
constexpr double kLineEvery_s = 10.0;  // rare enough for a log file, often enough to see that it lives
}

double IdentifyProgressText::left_s(const estimate::FitProgress& p, double elapsed_s) const {
  const auto [now, before, earlier] = to_fall_;
  const bool steady = known_ == 3 && now > 0.0 && now < before && before < earlier;
  if (fit_.noise.rounds > 0 || !steady || p.iteration < 1) return -1.0;
  // Near its end the fit falls by about the same factor each time; the slower of the last two is the safer guess.
  const double factor = std::max(now / before, before / earlier);
  const double more = std::clamp(std::ceil(std::log(fit_.tolerance / now) / std::log(factor)), 0.0,
                                 static_cast<double>(std::max(0, fit_.max_iterations - p.iteration)));
  return more * (elapsed_s - round_begun_s_) / p.iteration;
}

IdentifyProgressText::Told IdentifyProgressText::operator()(const identify::IdentifyProgress& p, double elapsed_s) {
  const bool new_part = p.part_number != part_, new_round = !new_part && p.fit.iteration <= iteration_;
  if (new_part || new_round) {
    round_ = new_part ? 1 : round_ + 1;
    round_begun_s_ = elapsed_s;
    known_ = 0;
  }
  part_ = p.part_number;
  iteration_ = p.fit.iteration;
  to_fall_ = {p.fit.decrement, to_fall_[0], to_fall_[1]};
  known_ = std::min(known_ + 1, 3);

  Told out;
  out.due = new_part || new_round || elapsed_s - last_line_s_ >= kLineEvery_s;
  if (out.due) last_line_s_ = elapsed_s;
  out.text = fmt::format("[{}/{}] {}{}: iteration {} of at most {}, cost {:.6g}", p.part_number, p.parts, p.part,
                         round_ > 1 ? fmt::format(" again, round {}", round_) : "", p.fit.iteration, fit_.max_iterations, p.fit.cost);
  // Ceres predicts nothing before its first step.
  if (p.fit.decrement > 0.0) out.text += fmt::format(", predicted decrease {:.2g}", p.fit.decrement);
  if (fit_.noise.rounds > 0) out.text += fmt::format(", noise round {}", p.fit.noise_round);
  out.text += fmt::format("; {} so far", duration_text(elapsed_s));
  if (const double left = left_s(p.fit, elapsed_s); left >= 0.0)
    out.text += fmt::format(", about {} left {}", duration_text(left), round_ > 1 ? "in this round" : "in this part");
  return out;
}

}  // namespace rotorloop::cli
