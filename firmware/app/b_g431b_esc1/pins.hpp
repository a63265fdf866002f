// What is wired where on the ST B-G431B-ESC1 (UM2516 revision 4 and its schematic MB1419), each with its confidence. A: the maker's manual
// and an independent program agree; B: two independent sources; C: one source, or sources that differ. What is B or C is listed in
// docs/first_power.md with how to measure it, and is changed here and nowhere else.
#pragma once
#include <array>

#include "firmware/board/g431/adc.hpp"
#include "firmware/board/g431/gpio.hpp"

namespace rotorloop::b_g431b_esc1 {

using g431::Pin;
using g431::Port;

struct GatePin {
  Pin pin;
  std::uint32_t function;  // that connects TIM1
};
// High sides of U, V, W, then low sides, as the bits of kAllGates. A. Inputs of the L6387E are active high on both sides. A.
inline constexpr std::array<GatePin, 6> kGates{
    {{{Port::a, 8}, 6}, {{Port::a, 9}, 6}, {{Port::a, 10}, 6}, {{Port::c, 13}, 4}, {{Port::a, 12}, 6}, {{Port::b, 15}, 4}}};

// Amplifier outputs on ADC1_IN3, ADC2_IN3, ADC1_IN12; bus on ADC1_IN1; thermistor on ADC1_IN5. A.
inline constexpr g431::AdcWiring kAdc{.u_adc1 = 3, .w_adc1 = 12, .v_adc2 = 3, .bus_adc1 = 1, .thermistor_adc1 = 5};
// Nodes of the phases U, V, W behind 10 k, PA4, PC4 and PB11: inputs of ADC2. With PB5 floating nothing divides them, and they end at the
// clamp to 3.3 V. B. Analogue from the reset on; the self-test alone reads them.
inline constexpr std::array<std::uint8_t, 3> kPhaseChannels{17, 5, 14};
inline constexpr std::array<Pin, 11> kAnalogPins{{{Port::a, 0},
                                                  {Port::a, 1},
                                                  {Port::a, 2},
                                                  {Port::a, 3},
                                                  {Port::a, 5},
                                                  {Port::a, 6},
                                                  {Port::a, 7},
                                                  {Port::b, 0},
                                                  {Port::b, 1},
                                                  {Port::b, 2},
                                                  {Port::b, 14}}};

inline constexpr Pin kCanRx{Port::a, 11}, kCanTx{Port::b, 9};  // function 9. A
inline constexpr std::uint32_t kCanFunction = 9;
inline constexpr Pin kCanShutdown{Port::c, 11};     // A
inline constexpr bool kCanRunsAt = false;           // B: one of three sources has it the other way
inline constexpr Pin kCanTermination{Port::c, 14};  // high: 120 ohm between the wires. A
inline constexpr bool kCanTerminated = false;       // at the end of a bus only
inline constexpr std::uint32_t kCanBitRate = 1'000'000;

inline constexpr Pin kLed{Port::c, 6};      // A
inline constexpr bool kLedOnAt = true;      // C
inline constexpr Pin kButton{Port::c, 10};  // pressed: low. A
inline constexpr Pin kUartTx{Port::b, 3};   // function 7. A
inline constexpr std::uint32_t kUartFunction = 7;

}  // namespace rotorloop::b_g431b_esc1
