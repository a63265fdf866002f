// Turned by hand or not: the firmware's answer on drawn boards and motors, through shunts that drift, carry noise and at times say
// nonsense. The rules follow from the arithmetic in turn_decoder.hpp; no seed was used to set them.
#include "firmware/core/motor/hand_watch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "bench/hil/esc_lab/esc_run.hpp"

namespace rotorloop::sim {
namespace {

constexpr double kLet_go = 1e9;  // no hand: a speed that nothing has
constexpr std::uint64_t kFirstSeed = 7001;

// One ESC with its main loop: asks every quarter of a millisecond as an enumeration does.
template <class Esc>
class Watched {
 public:
  explicit Watched(const NativeEscConfig& config) : esc_(config), watch_(config.firmware) {
    esc_.set_interrupt([this](typename Esc::Board& board) { return watch_.on_sample(board, esc_.motor().variables()); });
  }
  // A hand holds the shaft at `speed_rad_s`, or nobody does.
  void run(double seconds, double speed_rad_s = kLet_go, bool asked = true) {
    const auto periods = static_cast<std::int64_t>(seconds * kCurrentLoop_Hz);
    for (std::int64_t k = 0; k < periods; ++k) {
      if (k % 6 == 0) {
        watch_.want(asked);
        turned_at_s_ = watch_.turned() ? std::min(turned_at_s_, time_s_) : turned_at_s_;
        indications_ += watch_.turned() && !turned_ ? 1 : 0;
        turned_ = watch_.turned();
      }
      if (speed_rad_s != kLet_go) esc_.drive().motor().state().omega_rad_s = speed_rad_s;
      esc_.step_current_loop();
      time_s_ += 1.0 / kCurrentLoop_Hz;
      turns_ += esc_.omega_rad_s() / (2.0 * std::numbers::pi * kCurrentLoop_Hz);
      const auto& compare = esc_.board().compare.phase;
      if (esc_.board().bridge && esc_.motor().variables().blocked != firmware::Blocked::self_test) {
        high_side_ = high_side_ || compare[0] != 0 || compare[1] != 0 || compare[2] != 0;
        shorted_s_ += 1.0 / kCurrentLoop_Hz;
      }
    }
  }
  Esc& esc() { return esc_; }
  auto& watch() { return watch_; }
  int indications() const { return indications_; }
  double turned_at_s() const { return turned_at_s_; }
  double shorted_s() const { return shorted_s_; }
  bool high_side() const { return high_side_; }
  double turns() const { return std::fabs(turns_); }  // of the true rotor since the start

 private:
  Esc esc_;
  firmware::HandWatch<typename Esc::Board> watch_;
  double time_s_ = 0.0, turned_at_s_ = 1e9, shorted_s_ = 0.0, turns_ = 0.0;
  int indications_ = 0;
  bool turned_ = false, high_side_ = false;
};

// Calls f(watched) with a drawn motor of the class on a drawn board, as its data sheet describes it to the ESC.
template <class F>
void with_drawn(const esc_lab::MotorClass& c, std::uint64_t seed, const F& f) {
  const esc_lab::EscDraw draw = esc_lab::draw_esc(c, seed, esc_lab::Knowledge::data_sheet);
  esc_lab::with_esc_of(c.board, [&]<class Esc>() {
    NativeEscConfig config = esc_lab::native_config(draw);
    Watched<Esc> watched(config);
    f(watched);
  });
}

TEST(HandWatch, EveryHandOf10To60RadPerSecondIsFeltWithinTwoTurnsOnDrawnBoardsAndMotorsOfAllClassesAndIndicatedOnce) {
  int felt = 0, asked = 0;
  double most_turns = 0.0;
  for (const esc_lab::MotorClass& c : esc_lab::motor_classes()) {
    for (std::uint64_t seed = kFirstSeed; seed < kFirstSeed + 3; ++seed) {
      for (const double speed_rad_s : {-60.0, -25.0, -10.0, 10.0, 25.0, 60.0}) {
        with_drawn(c, seed, [&](auto& w) {
          w.run(0.1);
          w.run(2.0 * 2.0 * std::numbers::pi / std::fabs(speed_rad_s) + 0.1, speed_rad_s);
          w.run(0.1);
          ++asked;
          felt += w.indications() == 1 ? 1 : 0;
          most_turns = std::max(most_turns, (w.turned_at_s() - 0.1) * std::fabs(speed_rad_s) / (2.0 * std::numbers::pi));
          EXPECT_EQ(w.indications(), 1) << c.name << ", seed " << seed << ", " << speed_rad_s << " rad/s";
          EXPECT_FALSE(w.high_side());
        });
      }
    }
  }
  RecordProperty("felt", std::to_string(felt) + " of " + std::to_string(asked));
  RecordProperty("most_turns", std::to_string(most_turns));
}

TEST(HandWatch, NothingIsFeltAtRestOnDrawnBoardsAndTheMotorControlKeepsItsZeros) {
  const int boards = 20;
  const double seconds = 60.0;
  int false_indications = 0;
  double shorted_s = 0.0;
  for (std::uint64_t seed = kFirstSeed + 100; seed < kFirstSeed + 100 + boards; ++seed) {
    with_drawn(esc_lab::motor_classes()[seed % esc_lab::motor_classes().size()], seed, [&](auto& w) {
      w.run(seconds);
      false_indications += w.indications();
      shorted_s += w.shorted_s();
      EXPECT_FALSE(w.high_side());
      EXPECT_TRUE(w.esc().motor().calibrated());
      EXPECT_EQ(w.esc().telemetry().state, firmware::MotorState::off);
      EXPECT_GT(w.shorted_s(), 0.9 * seconds) << "seed " << seed << ": it has hardly looked";
    });
  }
  EXPECT_EQ(false_indications, 0);
  RecordProperty("false_indications", std::to_string(false_indications) + " in " + std::to_string(shorted_s) + " s of shorted windings");
}

struct Gust {
  int indications;
  double turns;  // of the true rotor, with what it coasts on until its shorted windings have stopped it
};
Gust gust(std::uint64_t seed, double speed_rad_s, double turns, std::uint16_t steps = 0) {
  Gust g{};
  with_drawn(*esc_lab::find_motor_class("5in"), seed, [&](auto& w) {
    if (steps > 0) w.watch().config().steps = steps;
    w.run(0.1);
    w.run(turns * 2.0 * std::numbers::pi / std::fabs(speed_rad_s), speed_rad_s);
    w.run(0.4);
    g = {w.indications(), w.turns()};
  });
  return g;
}

// Gusts that let go so late that the rotor coasts on beyond a turn are left out. Where three quadrants of an electrical turn are enough,
// each of the others is a hand.
TEST(HandWatch, AGustOfLessThanATurnIsNoHandAndWouldBeOneIfLessThanATurnWereEnough) {
  int indicated = 0, with_less = 0, gusts = 0;
  double most_turns = 0.0;
  for (std::uint64_t seed = kFirstSeed + 200; seed < kFirstSeed + 205; ++seed) {
    for (const double speed_rad_s : {-40.0, 10.0, 25.0, 60.0}) {
      for (const double turns : {0.2, 0.45, 0.7, 0.9}) {
        const Gust g = gust(seed, speed_rad_s, turns);
        if (g.turns >= 1.0) continue;
        ++gusts;
        most_turns = std::max(most_turns, g.turns);
        indicated += g.indications;
        with_less += gust(seed, speed_rad_s, turns, 3).indications > 0 ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(indicated, 0);
  EXPECT_GE(gusts, 50);
  EXPECT_GT(most_turns, 0.9);
  EXPECT_EQ(with_less, gusts);
  RecordProperty("gusts", std::to_string(indicated) + " of " + std::to_string(gusts) + ", the largest of " + std::to_string(most_turns) +
                              " turns; with less than a turn asked for " + std::to_string(with_less));
}

TEST(HandWatch, TheBridgeIsOffWithinOneSampleOfTheEndWithin21MsOfSilenceAndOnlyAnOffMotorIsShorted) {
  with_drawn(*esc_lab::find_motor_class("5in"), kFirstSeed + 300, [](auto& w) {
    w.run(0.2);
    ASSERT_TRUE(w.esc().board().bridge);
    w.run(0.0003, kLet_go, false);
    EXPECT_FALSE(w.esc().board().bridge);
    w.run(0.2);
    ASSERT_TRUE(w.esc().board().bridge);
    for (int k = 0; k < 24 * 21; ++k) w.esc().step_current_loop();  // a main loop that hangs
    EXPECT_FALSE(w.esc().board().bridge);
    // An order that comes while the question stands is followed when the motor control next has its interrupt, and the question rests.
    w.esc().set_setpoint({firmware::Mode::speed, 500.0f});
    w.run(2.0);
    EXPECT_EQ(w.esc().telemetry().state, firmware::MotorState::running);
    EXPECT_NEAR(w.esc().omega_rad_s(), 500.0, 5.0);
    EXPECT_FALSE(w.watch().shorted());
  });
}

TEST(HandWatch, ARotorThatAGaleTurnsFasterThanTheShuntsMeasureIsLetGo) {
  esc_lab::MotorClass c = *esc_lab::find_motor_class("7in");
  c.inductance_H = 2e-6;  // little in the way of the current
  with_drawn(c, kFirstSeed + 400, [](auto& w) {
    w.run(0.1);
    w.run(0.3, 600.0);
    EXPECT_TRUE(w.watch().too_fast());
    EXPECT_FALSE(w.esc().board().bridge);
    EXPECT_EQ(w.indications(), 0);
    w.run(0.01, kLet_go, false);
    EXPECT_FALSE(w.watch().too_fast());
  });
}

}  // namespace
}  // namespace rotorloop::sim
