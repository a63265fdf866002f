// A wrong bus name has to be refused before anything is armed, and the message has to say what would work.
#include "host/bus/bus_name.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "host/base/error.hpp"

namespace rotorloop {
namespace {

using ::testing::HasSubstr;

ErrorText refusal(std::string_view text) {
  try {
    parse_bus_name(text, "quad.toml:16");
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::usage);
    return e.text();
  }
  ADD_FAILURE() << text << " was accepted";
  return {};
}

TEST(BusName, VirtualBusIsBuiltInWithOrWithoutALabel) {
  EXPECT_EQ(parse_bus_name("virtual:", "").backend, BusBackend::virtual_bus);
  EXPECT_EQ(parse_bus_name("virtual:", "").rest, "");
  EXPECT_EQ(parse_bus_name("virtual:esc", "").rest, "esc");
}

TEST(BusName, EveryBackendInTheTableIsEitherAcceptedOrRefusedWithTheListOfWhatIsBuiltIn) {
  for (const BusBackendInfo& b : bus_backends()) {
    const std::string text = std::string(b.prefix) + ":x";
    if (b.built_in) {
      EXPECT_EQ(parse_bus_name(text, "").backend, b.backend);
    } else {
      const ErrorText error = refusal(text);
      EXPECT_EQ(error.where, "quad.toml:16");
      EXPECT_THAT(error.what, HasSubstr("has no " + std::string(b.prefix) + " backend"));
      EXPECT_THAT(error.remedy, HasSubstr("virtual:"));
    }
  }
}

TEST(BusName, BareInterfaceNameIsRefusedWithTheFormThatWasMeant) {
  const ErrorText error = refusal("can0");
  EXPECT_THAT(error.what, HasSubstr("\"can0\" names no known backend"));
  EXPECT_THAT(error.likely, HasSubstr("socketcan:can0"));
}

TEST(BusName, MissingColonIsNamed) { EXPECT_EQ(refusal("virtual").remedy, "write \"virtual:\""); }

TEST(BusName, RequiredRestMayNotBeEmpty) {
  constexpr std::array<BusBackendInfo, 1> kTable{{{BusBackend::socketcan, "socketcan", "an interface", true, true}}};
  EXPECT_EQ(parse_bus_name("socketcan:can1", "", kTable).rest, "can1");
  EXPECT_THROW(parse_bus_name("socketcan:", "", kTable), Error);
}

}  // namespace
}  // namespace rotorloop
