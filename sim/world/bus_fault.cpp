// Names of the fault kinds as scenario files write them.
#include "sim/world/bus_fault.hpp"

#include <array>
#include <utility>

namespace rotorloop::sim {
namespace {

constexpr std::array<std::pair<BusFaultKind, std::string_view>, 6> kNames{{
    {BusFaultKind::lose_sent, "lose_sent"},
    {BusFaultKind::lose_received, "lose_received"},
    {BusFaultKind::corrupt, "corrupt"},
    {BusFaultKind::silent, "silent"},
    {BusFaultKind::unplugged, "unplugged"},
    {BusFaultKind::extra_traffic, "extra_traffic"},
}};

}  // namespace

std::string_view name(BusFaultKind kind) {
  for (const auto& [k, n] : kNames) {
    if (k == kind) return n;
  }
  return "unknown";
}

std::optional<BusFaultKind> bus_fault_kind(std::string_view text) {
  for (const auto& [k, n] : kNames) {
    if (n == text) return k;
  }
  return std::nullopt;
}

}  // namespace rotorloop::sim
