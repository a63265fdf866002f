// Every number on which the name or the verdict of a diagnosis of flights can depend; docs/manual/deciding.md says in which question each
// of them stands. One number answers one question wherever it is asked. Not here: grids, folds, lengths of blocks, floors against rounding,
// and what is only remarked upon (contradicted priors, steps in time, lags).
#pragma once
#include <cstddef>

namespace rotorloop::diagnose {

struct Criteria {
  // Probability, 1: that what is absent is taken for present. Of the block-robust statistic of all candidates after Holm, of columns
  // without meaning (placebos) that an effect must surpass, of effects on the scatter after Holm, of a burst in a whole set of simulated
  // residuals. Ground effect of a rotor, felt for seconds of a minute, stands at 0.012 on development seed 713, where 0.01 loses it.
  double chance = 0.02;
  // Standard uncertainties, 1: an effect's numbers after the refit are found beyond this (a Wald test of the same chance for several), and
  // so much is the detection limit (Currie, Limits for qualitative detection, 1968); within it, a number of a refit is neutral, an estimate
  // may still be inside its range, a mean wind may be the gusts' own. A burst is a tenth of a second and more that far above the usual rms.
  double fewest_u = 3.3;
  // Of the size that matters of an effect (a term's scale; the typical size of the catalogue for what acts on the scatter), 1: a smaller
  // one is left out, however certain. Emergent differences between blade elements and reduced laws reach 0.17 on the nominal plant
  // (decision 0083).
  double relevant = 0.33;
  // Of the weight, and of the weight times the arm, 1: a residual force or torque that is less beyond noise is no lack of the model. The
  // reference plant leaves 0.003 and 0.0005 of them beyond the library's terms.
  double force_matters = 0.005, torque_matters = 0.002;
  // By which a reduced law is off, as a share of its own load, 1: what such an error leaves is no further effect; one linear step may pass
  // a bound by as much of the way to it.
  double law_error = 0.3;
  // The larger part, 1: a further effect keeps it beside what varies as another's law; names that explain less of the power missing are no
  // explanation; a candidate that explains less than it of what the leader does needs no refit; an effect whose size varies by more than it
  // over the flights is not one effect; chance predicts less than it of what is systematic; so much of a residual's power is in bursts.
  double larger_part = 0.5;
  // A share that counts for nothing, 1: of its gain that an effect shows on blocks that did not estimate it; of what it explained alone
  // that it is worth beside others; of a residual's power that any curve predicts on other blocks; and one less this share is the
  // correlation of the much alike.
  double negligible = 0.1;
  // Log likelihood, 1, deflated for correlated residuals (to negligible at most): effects within it are indistinguishable. Odds of 20 to 1.
  double class_margin = 3.0;
  // Canonical correlation, 1: columns that are more alike no refit distinguishes.
  double alike = 0.98;
  // Variance of the blocks over noise, 1: what reduced laws of a whole model leave scatters as much, so below it a first effect may vary.
  // Of lost lift in a band of speeds 12 to 13, of a constant force of 1.5 % of the weight below 2 (decision 0087).
  double scatter = 4.0;
  // Candidates, 1: of each order (likelihood, scatter, failed by scatter alone) so many are refitted in a round.
  std::size_t refits = 3;
};

}  // namespace rotorloop::diagnose
