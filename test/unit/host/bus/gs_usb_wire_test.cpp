// gs_usb without USB: bytes of requests and frames, bit timing beside the rule of Linux, the adapter's clock, echo ids.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/error.h>

#include <cmath>
#include <vector>

#include "host/bus/live/gs_usb/bit_timing.hpp"
#include "host/bus/live/gs_usb/in_flight.hpp"
#include "host/bus/live/gs_usb/stamp_wrap.hpp"
#include "host/bus/live/gs_usb/wire.hpp"
#include "test/unit/host/bus/live_support.hpp"

namespace rotorloop::gs_usb {
namespace {

using test::frame_of;
using ::testing::ElementsAre;
using ::testing::ElementsAreArray;
using Bytes = std::vector<std::uint8_t>;

Bytes encoded(const BusFrame& frame, std::uint32_t echo_id, unsigned channel, FrameLayout layout) {
  std::array<std::uint8_t, kLargest_B> bytes{};
  const std::size_t size = encode_frame(frame, echo_id, channel, layout, bytes);
  return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)};
}

TEST(GsUsbFrame, OfEveryKindAndLengthIsReadBackWithAndWithoutStamp) {
  for (const bool extended : {false, true}) {
    for (const bool fd : {false, true}) {
      for (std::size_t length = 0; length <= 64; ++length) {
        if (!possible_length(fd, length)) continue;
        const BusFrame sent = frame_of(extended ? 0x1401552Au : 0x7E0u, extended, length, fd);
        Bytes bytes = encoded(sent, kReceived, 1, {.fd = fd, .quirk = false});
        ASSERT_EQ(bytes.size(), fd ? 76u : 20u);
        const Message plain = decode_message(bytes, false);
        EXPECT_EQ(plain.content, Content::frame);
        EXPECT_EQ(plain.frame, sent);
        EXPECT_EQ(plain.channel, 1u);
        EXPECT_FALSE(plain.stamp_us);
        bytes.insert(bytes.end(), {0x40, 0xE2, 0x01, 0x80});
        const Message stamped = decode_message(bytes, true);
        EXPECT_EQ(stamped.frame, sent);
        EXPECT_EQ(stamped.stamp_us, 0x8001E240u);
      }
    }
  }
}

TEST(GsUsbFrame, HasTheBytesOfTheFirmware) {
  const Bytes classic = encoded(frame_of(0x123, true, 2), 3, 1, {});
  EXPECT_THAT(classic, ElementsAre(3, 0, 0, 0, 0x23, 0x01, 0, 0x80, 2, 1, 0, 0, 1, 8, 0, 0, 0, 0, 0, 0));
  const Bytes fd = encoded(frame_of(0x7FF, false, 12, true), 9, 0, {.fd = true, .quirk = false});
  EXPECT_THAT(Bytes(fd.begin(), fd.begin() + 13), ElementsAre(9, 0, 0, 0, 0xFF, 0x07, 0, 0, 9, 0, 6, 0, 1))
      << "code 9 is 12 bytes; flags FD and BRS";
  EXPECT_EQ(encoded(frame_of(1, false, 8), 0, 0, {.fd = true, .quirk = false}).size(), 76u)
      << "a channel with FD sends every frame in that size";
  EXPECT_EQ(encoded(frame_of(1, false, 8), 0, 0, {.fd = false, .quirk = true}).size(), 21u);
}

TEST(GsUsbFrame, ThatIsAnEchoRemoteOrAnErrorReportIsTold) {
  Bytes bytes = encoded(frame_of(0x123, false, 8), 7, 0, {});
  EXPECT_EQ(decode_message(bytes, false).content, Content::echo);
  EXPECT_EQ(decode_message(bytes, false).echo_id, 7u);
  bytes = encoded(frame_of(0x123, false, 8), kReceived, 0, {});
  bytes[7] = 0x40;
  EXPECT_EQ(decode_message(bytes, false).content, Content::remote);
  bytes = encoded(frame_of(CAN_ERR_BUSOFF, false, 8), kReceived, 1, {});
  bytes[7] = 0x20;
  bytes[18] = 255;
  const Message report = decode_message(bytes, false);
  EXPECT_EQ(report.content, Content::error_report);
  EXPECT_EQ(report.report.state, BusState::bus_off);
  EXPECT_EQ((*report.report.errors_tx_rx)[0], 255);
  bytes[10] = 1;
  EXPECT_TRUE(decode_message(bytes, false).overflow);
}

TEST(GsUsbFrame, CutAnywhereOrWithAnyByteTurnedIsMalformedOrAPossibleFrame) {
  for (const bool fd : {false, true}) {
    const Bytes whole = encoded(frame_of(0x1401552A, true, fd ? 64 : 8, fd), kReceived, 0, {.fd = fd, .quirk = false});
    for (std::size_t at = 0; at < whole.size(); ++at) {
      const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(at));  // the sanitizer sees its end
      EXPECT_EQ(decode_message(cut, true).content, Content::malformed);
      for (unsigned value = 0; value < 256; ++value) {
        Bytes turned = whole;
        turned[at] = static_cast<std::uint8_t>(value);
        const Message m = decode_message(turned, true);
        if (m.content == Content::frame) {
          EXPECT_TRUE(possible(m.frame)) << at << " " << value;
        }
      }
    }
  }
}

TEST(GsUsbRequest, HasItsNumbersLittleEndian) {
  EXPECT_THAT(encode_word(kHostFormat), ElementsAre(0xEF, 0xBE, 0, 0));
  EXPECT_THAT(encode_mode(kModeStart, kHardwareStamp | kFd), ElementsAre(1, 0, 0, 0, 0x10, 1, 0, 0));
  const BitTiming t{.prop_seg = 6, .phase_seg1 = 7, .phase_seg2 = 2, .sjw = 1, .prescaler = 0x101};
  EXPECT_THAT(encode_timing(t), ElementsAre(6, 0, 0, 0, 7, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 0));
}

TEST(GsUsbAnswer, ThatIsCutIsNone) {
  const Bytes config{0, 0, 0, 1, 2, 0, 0, 0, 0x0B, 0, 0, 0};
  EXPECT_EQ(decode_device_config(config)->channels, 2u);
  EXPECT_EQ(decode_device_config(config)->hardware, 11u);
  EXPECT_FALSE(decode_device_config(std::span(config).first(11)));
  Bytes limits(72);
  for (std::size_t i = 0; i < 18; ++i) limits[4 * i] = static_cast<std::uint8_t>(i + 1);
  const auto both = decode_channel(limits), classic = decode_channel(std::span(limits).first(71));
  EXPECT_EQ(both->nominal, (BitTimingLimits{3, 4, 5, 6, 7, 8, 9, 10}));
  EXPECT_EQ(both->data, (BitTimingLimits{11, 12, 13, 14, 15, 16, 17, 18}));
  EXPECT_FALSE(classic->data);
  EXPECT_FALSE(decode_channel(std::span(limits).first(39)));
  EXPECT_FALSE(decode_state(std::span(limits).first(11)));
  EXPECT_FALSE(decode_word(std::span(limits).first(3)));
}

// How Linux 6.1 chooses (drivers/net/can/dev/calc_bittiming.c), as a rule: quanta from most to fewest, the prescaler rounded down and up;
// less error of the rate (whole bit/s) first, then of the sample point, which is not to be later than asked for.
struct KernelChoice {
  std::uint32_t prescaler = 0, quanta = 0, seg2 = 0;
};
KernelChoice kernel_choice(std::uint32_t clock_Hz, std::uint32_t rate_Hz, std::uint32_t sample_permille, const BitTimingLimits& l) {
  KernelChoice best;
  std::uint32_t best_rate_error = UINT32_MAX, best_sample_error = UINT32_MAX;
  for (std::uint32_t inner = l.seg1_max + l.seg2_max; inner >= l.seg1_min + l.seg2_min; --inner) {
    for (const std::uint32_t up : {1u, 0u}) {
      const std::uint32_t quanta = inner + 1;
      const std::uint32_t prescaler = (clock_Hz / (quanta * rate_Hz) + up) / l.prescaler_step * l.prescaler_step;
      if (prescaler < l.prescaler_min || prescaler > l.prescaler_max) continue;
      const std::uint32_t rate = clock_Hz / (prescaler * quanta), error = rate > rate_Hz ? rate - rate_Hz : rate_Hz - rate;
      if (error > best_rate_error) continue;
      if (error < best_rate_error) best_sample_error = UINT32_MAX;
      std::uint32_t sample_error = UINT32_MAX, seg2 = 0;
      for (const std::uint32_t less : {0u, 1u}) {
        std::uint32_t tried = std::clamp(quanta - sample_permille * quanta / 1000 - less, l.seg2_min, l.seg2_max);
        if (inner - tried > l.seg1_max) tried = inner - l.seg1_max;
        const std::uint32_t sample = 1000 * (quanta - tried) / quanta;
        if (sample > sample_permille || sample_permille - sample >= sample_error) continue;
        sample_error = sample_permille - sample;
        seg2 = tried;
      }
      if (sample_error >= best_sample_error) continue;
      best_rate_error = error;
      best_sample_error = sample_error;
      best = {.prescaler = prescaler, .quanta = quanta, .seg2 = seg2};
    }
  }
  return best;
}

constexpr BitTimingLimits kBxCan{1, 16, 1, 8, 4, 1, 1024, 1}, kFdNominal{2, 256, 2, 128, 128, 1, 512, 1},
    kFdData{1, 32, 1, 16, 16, 1, 32, 1}, kEvenPrescaler{2, 64, 2, 16, 16, 2, 256, 2};

bool within(const BitTiming& t, const BitTimingLimits& l) {
  const std::uint32_t seg1 = t.prop_seg + t.phase_seg1;
  return seg1 >= l.seg1_min && seg1 <= l.seg1_max && t.phase_seg2 >= l.seg2_min && t.phase_seg2 <= l.seg2_max &&
         t.prescaler >= l.prescaler_min && t.prescaler <= l.prescaler_max && (t.prescaler - l.prescaler_min) % l.prescaler_step == 0 &&
         t.sjw >= 1 && t.sjw <= l.sjw_max && t.sjw <= t.phase_seg2;
}

TEST(GsUsbBitTiming, IsForAllClocksFrom8To170MHzAndAllStandardRatesAsGoodAsTheRuleOfLinuxOrBetter) {
  int compared = 0, better = 0, worse = 0;
  for (const auto& limits : {kBxCan, kFdNominal, kFdData, kEvenPrescaler}) {
    for (std::uint32_t clock_Hz = 8'000'000; clock_Hz <= 170'000'000; clock_Hz += 500'000) {
      for (const std::uint32_t rate_Hz : {10'000u, 20'000u, 50'000u, 83'333u, 100'000u, 125'000u, 250'000u, 500'000u, 800'000u, 1'000'000u,
                                          2'000'000u, 4'000'000u, 5'000'000u, 8'000'000u}) {
        for (const std::uint32_t sample_permille : {875u, 750u}) {
          const auto ours = choose_bit_timing(clock_Hz, rate_Hz, sample_permille / 1000.0, limits);
          const KernelChoice theirs = kernel_choice(clock_Hz, rate_Hz, sample_permille, limits);
          ASSERT_TRUE(!ours || within(*ours, limits)) << clock_Hz << " " << rate_Hz;
          if (theirs.prescaler == 0) continue;
          ASSERT_TRUE(ours) << clock_Hz << " " << rate_Hz;
          ++compared;
          const double product = static_cast<double>(theirs.prescaler) * theirs.quanta;
          const double rate_error_ppm = std::abs(clock_Hz - rate_Hz * product) / (rate_Hz * product) * 1e6;
          const double sample_error = std::abs(static_cast<double>(theirs.quanta - theirs.seg2) / theirs.quanta - sample_permille / 1000.0);
          const double our_sample_error = std::abs(ours->sample_point - sample_permille / 1000.0);
          const bool same_rate = ours->rate_error_ppm == rate_error_ppm;
          worse += ours->rate_error_ppm > rate_error_ppm || (same_rate && our_sample_error > sample_error + 1e-12);
          better += ours->rate_error_ppm < rate_error_ppm || (same_rate && our_sample_error < sample_error - 1e-12);
        }
      }
    }
  }
  EXPECT_EQ(worse, 0);
  EXPECT_GT(compared, 30'000);
  RecordProperty("compared", compared);
  RecordProperty("better", better);
  std::printf("bit timing: %d settings compared, %d better than the rule of Linux\n", compared, better);
}

TEST(GsUsbBitTiming, OfDroneCanOnAnOldAdapterHas16QuantaAndSamplesAt87Percent) {
  const BitTiming t = *choose_bit_timing(48'000'000, 1'000'000, kSamplePoint, kBxCan);
  EXPECT_EQ(t.quanta(), 16u);
  EXPECT_EQ(t.prescaler, 3u);
  EXPECT_EQ(t.prop_seg + t.phase_seg1, 13u);
  EXPECT_EQ(t.phase_seg2, 2u);
  EXPECT_EQ(t.rate_error_ppm, 0.0);
  EXPECT_EQ(t.sample_point, 0.875);
}

TEST(GsUsbBitTiming, ThatCannotBeExactTellsItsError) {
  const BitTiming t = *choose_bit_timing(48'000'000, 830'000, kSamplePoint, kBxCan);
  EXPECT_NEAR(t.rate_Hz, 48e6 / 57, 1.0) << "58 periods would be nearer, and are 2 of 29 quanta, which this controller has not";
  EXPECT_NEAR(t.rate_error_ppm, std::abs(t.rate_Hz / 830e3 - 1) * 1e6, 0.1);
  EXPECT_GT(t.rate_error_ppm, kMostRateError_ppm);
}

TEST(GsUsbBitTiming, OfLimitsThatNoControllerHasIsNone) {
  EXPECT_FALSE(choose_bit_timing(0, 1'000'000, kSamplePoint, kBxCan));
  EXPECT_FALSE(choose_bit_timing(48'000'000, 0, kSamplePoint, kBxCan));
  for (int field = 0; field < 8; ++field) {
    for (const std::uint32_t value : {0u, 0xFFFFFFFFu}) {
      BitTimingLimits l = kBxCan;
      std::array<std::uint32_t*, 8> fields{&l.seg1_min, &l.seg1_max,      &l.seg2_min,      &l.seg2_max,
                                           &l.sjw_max,  &l.prescaler_min, &l.prescaler_max, &l.prescaler_step};
      *fields[static_cast<std::size_t>(field)] = value;
      const auto t = choose_bit_timing(48'000'000, 1'000'000, kSamplePoint, l);  // returns, and within the limits
      EXPECT_TRUE(!t || within(*t, l)) << field << " " << value;
      EXPECT_TRUE(value != 0 || !t) << field;
    }
  }
}

TEST(GsUsbStamp, GoesOnOverTheWrapOf32BitsAndTakesStampsOutOfOrder) {
  StampWrap w;
  const std::int64_t first = w.unwrapped_ns(0xFFFFFF00);
  EXPECT_EQ(w.unwrapped_ns(0x00000100) - first, 512 * 1000);
  EXPECT_EQ(w.unwrapped_ns(0xFFFFFFF0) - first, 240 * 1000) << "an echo that was stamped before and came later";
  EXPECT_EQ(w.unwrapped_ns(0x00000100) - first, 512 * 1000);
  std::int64_t newest = w.unwrapped_ns(0x00000200);
  for (std::uint32_t quarter = 1; quarter <= 40; ++quarter) {  // ten turns, 12 hours
    const std::int64_t next = w.unwrapped_ns(0x00000200 + quarter * 0x40000000u);
    EXPECT_EQ(next - newest, std::int64_t{0x40000000} * 1000);
    newest = next;
  }
}

TEST(GsUsbInFlight, HasTenNumbersEachFreeAfterItsTransferAndItsEcho) {
  InFlight f;
  for (std::uint32_t id = 0; id < 10; ++id) EXPECT_EQ(f.begin(0), id);
  EXPECT_FALSE(f.begin(0));
  EXPECT_TRUE(f.confirmed(4)) << "an echo may be seen before the end of the transfer";
  EXPECT_FALSE(f.begin(0));
  EXPECT_FALSE(f.transferred(4, true));
  EXPECT_EQ(f.begin(0), 4u);
  EXPECT_FALSE(f.transferred(5, true));
  EXPECT_FALSE(f.begin(0));
  EXPECT_TRUE(f.confirmed(5));
  EXPECT_FALSE(f.confirmed(5)) << "twice";
  EXPECT_FALSE(f.confirmed(10));
  EXPECT_FALSE(f.confirmed(0x12345678));
  EXPECT_TRUE(f.transferred(6, false)) << "it did not reach the adapter: no echo will come";
  EXPECT_EQ(f.begin(0), 5u);
  EXPECT_EQ(f.begin(0), 6u);
  EXPECT_EQ(f.unconfirmed(), 10u);
}

TEST(GsUsbInFlight, GivesALostEchoUpWhenAFrameOfASecondLaterIsConfirmed) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  InFlight f;
  const std::uint32_t lost = *f.begin(0), later = *f.begin(kSecond_ns - 1);
  f.transferred(lost, true);
  f.transferred(later, true);
  EXPECT_EQ(f.give_up_lost(), 0u);
  f.confirmed(later);
  EXPECT_EQ(f.give_up_lost(), 0u);
  const std::uint32_t last = *f.begin(kSecond_ns);
  f.transferred(last, true);
  EXPECT_EQ(f.give_up_lost(), 0u) << "on a silent bus nothing is given up: it may still be sent";
  f.confirmed(last);
  EXPECT_EQ(f.give_up_lost(), 1u);
  EXPECT_EQ(f.unconfirmed(), 0u);
  EXPECT_EQ(f.begin(kSecond_ns), lost);
  EXPECT_EQ(f.clear(), 1u);
}

}  // namespace
}  // namespace rotorloop::gs_usb
